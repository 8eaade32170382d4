"""A small BOP data set for the tests of tribin bop: brackets on a table, simulated."""
import shutil
import subprocess


def prism_stl(path, outline, height):
    """A prism over a star-shaped outline (counter-clockwise, seen from its first corner) between z = 0 and height."""
    triangles = []
    n = len(outline)
    for i in range(1, n - 1):
        a, b, c = outline[0], outline[i], outline[i + 1]
        triangles += [[(*a, height), (*b, height), (*c, height)], [(*a, 0), (*c, 0), (*b, 0)]]
    for i in range(n):
        a, b = outline[i], outline[(i + 1) % n]
        triangles += [[(*a, 0), (*b, 0), (*b, height)], [(*a, 0), (*b, height), (*a, height)]]
    lines = ["solid part"]
    for t in triangles:
        lines += ["facet normal 0 0 0", "outer loop"] + ["vertex %g %g %g" % v for v in t] + ["endloop", "endfacet"]
    path.write_text("\n".join(lines + ["endsolid part", ""]))
    return path


def simulated(tribin, folder, scenes):
    """The data set's folder; None where the simulated camera is not built in."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    angle = prism_stl(folder.parent / "angle.stl", [(0, 0), (70, 0), (70, 20), (25, 20), (20, 55), (0, 55)], 30)
    wedge = prism_stl(folder.parent / "wedge.stl", [(0, 0), (60, 0), (45, 40), (0, 50)], 20)
    made = subprocess.run([tribin, "simulate", "--part", angle, "--part", wedge, "--scenes", str(scenes), "--seed", "5",
                           "-o", folder], capture_output=True, text=True)
    if made.returncode == 2 and "not built in" in made.stderr:
        return None
    if made.returncode != 0:
        raise RuntimeError(made.stderr)
    return folder
