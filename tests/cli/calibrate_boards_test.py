#!/usr/bin/env python3
"""tribin calibrate camera and rig on pictures of boards that are drawn here, whole and with each fault that happens.

usage: calibrate_boards_test.py TRIBIN WORK_DIR. Exit code 77 = python3-numpy, python3-pil or the component is missing.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import unittest

try:
    import numpy as np
    from PIL import Image, ImageFilter
except ImportError as missing:
    print("SKIPPED:", missing)
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[2]
TRIBIN, WORK = sys.argv[1], pathlib.Path(sys.argv[2])
COLUMNS, ROWS, PITCH = 9, 6, 20.0
SIZE, K = (640, 480), np.array([[800.0, 0, 318], [0, 802, 243], [0, 0, 1]])
RIGHT = (np.array([0.0, -0.25, 0.01]), np.array([150.0, 3, 20]))  # rig_from_right: rotation vector, place


def rotation(w):
    angle = np.linalg.norm(w)
    if angle == 0:
        return np.eye(3)
    x, y, z = w / angle
    c = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * c + (1 - np.cos(angle)) * c @ c


def pose(view):
    """camera_from_board: its rotation and place."""
    random = np.random.default_rng(view)
    turn = rotation(np.array([0, 0, random.uniform(-.3, .3)])) @ rotation(np.array([*random.uniform(-.6, .6, 2), 0]))
    return turn, np.array([*random.uniform(-60, 60, 2), random.uniform(420, 520)]) - turn @ np.array([80, 50, 0.0])


def albedo(x, y):
    """Of the board and the table behind it, at board coordinates in squares [grey levels under full light]."""
    dark = (np.floor(x) + np.floor(y)) % 2 == 0
    squares = (x > -1) & (y > -1) & (x < COLUMNS) & (y < ROWS)
    paper = (x > -2) & (y > -2) & (x < COLUMNS + 1) & (y < ROWS + 1)
    return np.where(squares & dark, 40.0, np.where(paper, 200.0, 90.0))


def on_board(turn, place, supersampling):
    """Where each pixel of the camera meets the board's plane [mm]."""
    n = supersampling
    v, u = np.mgrid[0:SIZE[1] * n, 0:SIZE[0] * n]
    pixels = np.stack([(u - (n - 1) / 2) / n, (v - (n - 1) / 2) / n, np.ones(u.shape)], -1).reshape(-1, 3).T
    p = np.linalg.inv(K @ np.column_stack([turn[:, 0], turn[:, 1], place])) @ pixels
    return p[0] / p[2], p[1] / p[2]


def mean_of(values, n):
    return values.reshape(SIZE[1], n, SIZE[0], n).mean((1, 3))


def picture(view, right=False, scale=1):
    """The board of a view, nine samples a pixel."""
    turn, place = pose(view)
    if right:
        back = rotation(RIGHT[0]).T
        turn, place = back @ turn, back @ (place - RIGHT[1])
    x, y = on_board(turn, place, 3)
    grey = mean_of(albedo(x / PITCH, y / PITCH), 3)
    return (grey + np.random.default_rng(view).normal(0, 1.5, grey.shape)).clip(0, 255) * scale


def frames(view, patterns, folder):
    """What the camera takes of the board under each pattern of a projector at RIGHT, whose lens is K."""
    turn, place = pose(view)
    x, y = on_board(turn, place, 2)
    in_camera = np.outer(turn[:, 0], x) + np.outer(turn[:, 1], y) + place[:, None]
    in_projector = rotation(RIGHT[0]).T @ (in_camera - RIGHT[1][:, None])
    lit = K @ in_projector
    u, v = np.rint(lit[0] / lit[2]).astype(int), np.rint(lit[1] / lit[2]).astype(int)
    seen = (u >= 0) & (v >= 0) & (u < SIZE[0]) & (v < SIZE[1])
    light = albedo(x / PITCH, y / PITCH)
    random = np.random.default_rng(view)
    for file in sorted(patterns.glob("*.png")):
        shown = np.asarray(Image.open(file), dtype=float)[v.clip(0, SIZE[1] - 1), u.clip(0, SIZE[0] - 1)] / 255
        grey = mean_of(light * (0.05 + 0.95 * np.where(seen, shown, 0)), 2)
        save(folder / file.name, (grey + random.normal(0, 1.5, grey.shape)).clip(0, 255))
    shutil.copy(patterns / "frames.json", folder)


def save(path, grey):
    path.parent.mkdir(parents=True, exist_ok=True)
    wide = grey.max() > 255
    Image.fromarray(np.rint(grey).astype(np.uint16 if wide else np.uint8)).save(path)


def run(*arguments, size="9x6", out="rig.json"):
    return subprocess.run([TRIBIN, "calibrate", *map(str, arguments), "--size", size, "--pitch-mm", "20", "-o", WORK / out],
                          capture_output=True, text=True, timeout=300)


class CalibrateBoards(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        for view in range(1, 11):
            save(WORK / f"left/left{view:02}.png", picture(view))
            save(WORK / f"right/right{view:02}.png", picture(view, right=True))

    def folder(self, name, views=range(1, 6)):
        shutil.rmtree(WORK / name, ignore_errors=True)
        (WORK / name).mkdir()
        for view in views:
            shutil.copy(WORK / f"left/left{view:02}.png", WORK / name / f"{view:02}.png")
        return WORK / name

    def fails(self, out, code, *words):
        self.assertEqual((out.returncode, out.stderr.count("\n")), (code, 1), out.stderr)
        for word in words:
            self.assertIn(word, out.stderr)

    def test_rig_by_numbers_in_the_names(self):
        out = run("rig", f"left={WORK / 'left'}", f"right={WORK / 'right'}", "--json", "-", "--report", WORK / "page")
        self.assertEqual(out.returncode, 0, out.stderr)
        page = (WORK / "page/index.html").read_text()
        self.assertEqual((page.count("<svg viewBox=\"0 0 640 480\""), page.count("left out</span>")), (2, 0))
        (WORK / "result.json").write_text(out.stdout)
        checked = subprocess.run([sys.executable, ROOT / "tools/validate_json", ROOT / "schema/calibration.schema.json",
                                  WORK / "result.json"], capture_output=True, text=True)
        self.assertIn(checked.returncode, (0, 77), checked.stdout)
        result = json.loads(out.stdout)
        self.assertEqual(([v["id"] for v in result["views"]], result["not_found"]), ([str(i) for i in range(1, 11)], []))
        self.assertLess(result["rms_px"], 0.1)
        left, right = result["devices"]
        for device in (left, right):
            for name, i, truth in (("fx", 0, 800), ("cx", 2, 318), ("fy", 4, 802), ("cy", 5, 243)):
                self.assertLess(abs(device["K"][i] - truth), 4 * device["sd"][name] + 1e-6, name)
        off = np.array(right["rig_from_camera"]["translation_mm"]) - RIGHT[1]
        self.assertLess(np.linalg.norm(off), 5 * right["sigma_mm"])
        rig = json.loads((WORK / "rig.json").read_text())
        self.assertEqual(([c["name"] for c in rig["cameras"]], rig["projector"]), (["left", "right"], None))
        np.testing.assert_allclose(rig["cameras"][1]["K"], right["K"], atol=1e-3)
        again = run("rig", f"left={WORK / 'left'}", f"right={WORK / 'right'}", "--json", "-", "--threads", "1")
        self.assertEqual(out.stdout, again.stdout)

    def test_wrong_size_says_what_the_picture_shows(self):
        self.fails(run("camera", self.folder("plain"), size="8x6"), 4, "no chessboard of 8 x 6 inner corners", "9 x 6")

    def test_mixed_sizes_name_the_picture(self):
        folder = self.folder("mixed")
        Image.open(folder / "03.png").resize((320, 240)).save(folder / "03.png")
        self.fails(run("camera", folder), 3, "03.png", "saw 320 x 240 px, wanted 640 x 480")

    def test_too_few_views_and_no_pictures(self):
        self.fails(run("camera", self.folder("few", (1, 2))), 4, "saw 2 views of the board, wanted 3 at least")
        self.fails(run("camera", self.folder("none", ())), 3, "saw no picture in this folder")
        self.fails(run("camera", WORK / "absent"), 3, "absent")
        (self.folder("text") / "04.png").write_text("no picture")
        self.fails(run("camera", WORK / "text"), 3, "04.png: whole file: saw no picture")

    def test_bad_options(self):
        for arguments, words in ((("rig", f"left={WORK / 'left'}"), "two or more"), (("rig", "left"), "NAME=FOLDER"),
                                 (("rig", f"a={WORK / 'left'}", f"a={WORK / 'right'}"), "two cameras 'a'"),
                                 (("camera", WORK / "left", "--board", "charuco"), "marker")):
            self.fails(run(*arguments), 2, words)
        self.fails(run("camera", WORK / "left", size="9"), 2, "COLUMNSxROWS")
        self.fails(run("camera", WORK / "left", size="1x6"), 2, "columns: saw 1")

    def test_partial_blurred_and_16_bit_views(self):
        folder = self.folder("faults", range(1, 9))
        part = picture(2)
        part[:, :260] = 90
        save(folder / "02.png", part)
        Image.open(folder / "04.png").filter(ImageFilter.GaussianBlur(25)).save(folder / "04.png")
        out = run("camera", folder)
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertIn("02.png: no chessboard of 9 x 6 inner corners was found", out.stderr)
        self.assertIn("04.png: no chessboard", out.stderr)
        self.assertIn("6 views of the board are in use; 10 to 20 are good", out.stderr)
        for view in range(1, 9):  # 12 bit of a camera, in 16
            save(folder / f"{view:02}.png", picture(view, scale=16))
        wide = run("camera", folder, "--json", "-")
        self.assertEqual(wide.returncode, 0, wide.stderr)
        self.assertLess(json.loads(wide.stdout)["rms_px"], 0.1)

    def test_a_board_that_moved_between_the_pictures_is_named(self):
        for view in range(1, 11):
            save(WORK / f"moved/l/{view}.png", picture(view))
            save(WORK / f"moved/r/{view}.png", picture(view if view != 7 else 3, right=True))
        out = run("rig", f"l={WORK / 'moved/l'}", f"r={WORK / 'moved/r'}", "--json", "-", "--report", WORK / "page")
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertEqual((WORK / "page/index.html").read_text().count("left out</span>"), 1)
        self.assertIn("View '7' does not fit the others", out.stderr)
        result = json.loads(out.stdout)
        self.assertEqual([v["id"] for v in result["views"] if not v["used"]], ["7"])
        self.assertLess(result["rms_px"], 0.1)

    def test_projector_from_its_own_patterns_and_a_scan_with_it(self):
        patterns = WORK / "patterns"
        done = subprocess.run([TRIBIN, "patterns", "--size", "640x480", "--axes", "both", "--camera", "left", "-o", patterns],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        for view in range(1, 7):
            frames(view, patterns, WORK / f"stops/{view}")
        out = run("projector", WORK / "stops", "--json", "-", out="projector.json")
        self.assertEqual(out.returncode, 0, out.stderr)
        camera, projector = json.loads(out.stdout)["devices"]
        self.assertEqual((camera["name"], camera["projector"], projector["projector"]), ("left", False, True))
        for name, i, truth in (("fx", 0, 800), ("cx", 2, 318), ("fy", 4, 802), ("cy", 5, 243)):
            self.assertLess(abs(projector["K"][i] - truth), 5 * projector["sd"][name], name)
        off = np.array(projector["rig_from_camera"]["translation_mm"]) - RIGHT[1]
        self.assertLess(np.linalg.norm(off), 5 * projector["sigma_mm"])
        scanned = subprocess.run([TRIBIN, "scan", WORK / "stops/1", "--calibration", WORK / "projector.json",
                                  "-o", WORK / "board.ply"], capture_output=True, text=True)
        self.assertEqual((scanned.returncode, scanned.stderr), (0, ""))
        self.assertEqual(run("projector", WORK / "stops", "--projector-size", "x", out="p.json").returncode, 2)
        # Onto cameras that are calibrated already: they are kept as they are, those without frames too.
        cameras = json.loads((WORK / "projector.json").read_text())
        cameras["projector"] = None
        cameras["cameras"].append(dict(cameras["cameras"][0], name="other"))
        (WORK / "cameras.json").write_text(json.dumps(cameras))
        out = run("projector", WORK / "stops", "--rig", WORK / "cameras.json", out="both.json")
        self.assertEqual(out.returncode, 0, out.stderr)
        self.assertNotIn("warning: left", out.stderr)  # what is known is not told to be looked at again
        both = json.loads((WORK / "both.json").read_text())
        self.assertEqual(both["cameras"], cameras["cameras"])
        before = json.loads((WORK / "projector.json").read_text())["projector"]
        self.assertLess(abs(both["projector"]["K"][0] - before["K"][0]), 5 * projector["sd"]["fx"])
        cameras["cameras"] = cameras["cameras"][1:]
        (WORK / "cameras.json").write_text(json.dumps(cameras))
        self.fails(run("projector", WORK / "stops", "--rig", WORK / "cameras.json", out="both.json"), 3, "no camera left")

    def test_projector_wants_frames(self):
        self.fails(run("projector", WORK / "left"), 3, "frames.json")
        self.fails(run("projector", WORK / "absent"), 3, "saw no folder")


if __name__ == "__main__":
    if "not built in" in run("camera", WORK).stderr:
        print("SKIPPED: calibration from pictures is not built in")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1], verbosity=1)
