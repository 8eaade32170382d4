#include "tribin/io/cad_files.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "support/shared_data.hpp"
#include "support/solids.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/cad/mend.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/convert.hpp"
#include "tribin/io/write.hpp"

namespace tribin {
namespace {

TEST(ReadCad, AllFormatsGiveTheSameMesh) {
  const test::TemporaryFolder folder;
  Mesh truth;
  test::add_box(truth, {1, 2, 3}, {11.1f, 22.2f, 33.3f});
  test::add_box(truth, {20, 0, 0}, {30, 10.7f, 10});
  mend_mesh(truth);
  for (const std::string& extension : writable_mesh_extensions()) {
    SCOPED_TRACE(extension);
    const auto path = folder.path() / ("part" + extension);
    write_mesh(path, truth);
    const Mesh seen = read_cad(path);
    EXPECT_EQ(seen.name, "part");
    EXPECT_EQ(seen.vertices.size(), truth.vertices.size());
    EXPECT_EQ(seen.triangles.size(), truth.triangles.size());
    EXPECT_DOUBLE_EQ(signed_volume(seen), signed_volume(truth));
    EXPECT_DOUBLE_EQ(surface_area(seen), surface_area(truth));
    EXPECT_TRUE(seen.oriented);
    EXPECT_TRUE(seen.warnings.empty());
    const Mesh inches = read_cad(path, {.unit = LengthUnit::inch});  // DXF says millimetres itself
    EXPECT_NEAR(signed_volume(inches) / signed_volume(truth), extension == ".dxf" ? 1 : 25.4 * 25.4 * 25.4, 1e-2);
  }
}

TEST(ReadCad, ObjPolygonsMayBeConcaveAndCountBack) {
  const test::TemporaryFolder folder;
  // An L of area 3, once with numbers from the start and once from the end, with textures and normals.
  const std::string corners = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n";
  for (const char* face : {"f 1 2 3 4 5 6\n", "f 1/1 2/2 3/3 4/4 5/5 6/6\n", "f -6//1 -5//1 -4//1 -3//1 -2//1 -1//1\n",
                           "f 1 2 3 \\\n4 5 6\n"}) {
    SCOPED_TRACE(face);
    const Mesh mesh = read_cad(folder.write("l.obj", corners + face));
    EXPECT_NEAR(surface_area(mesh), 3, 1e-6);
    EXPECT_FALSE(mesh.oriented);  // a plate
  }
}

TEST(ReadCad, SaysWhatStepNeeds) {
  try {
    read_cad("part.step");
    // Where the component is linked in, the missing file is what is wrong.
  } catch (const Error& error) {
    if (error.code() == ErrorCode::bad_option) {
      EXPECT_NE(std::string(error.what()).find("install"), std::string::npos);
    }
  }
}

TEST(ReadCad, ARegisteredReaderTakesItsExtension) {
  register_cad_reader(".fake", [](const std::filesystem::path& path, const CadReadOptions&) {
    Mesh mesh;
    mesh.name = path.stem();
    return mesh;
  });
  EXPECT_EQ(read_cad("thing.FAKE").name, "thing");
}

/// Runs a Python program with ezdxf; false where there is none.
bool run_ezdxf(const test::TemporaryFolder& folder, const std::string& program) {
  const auto script = folder.write("make.py", "import math, sys, ezdxf\nfolder = sys.argv[1]\n" + program);
  return std::system(
             ("/usr/bin/python3 " + script.string() + " " + folder.path().string() + " 2> /dev/null").c_str()) == 0;
}

TEST(ReadDxf, AgreesWithEzdxfOnEachKindOfSurface) {
  const test::TemporaryFolder folder;
  // The 24-sided prism r 10 h 30, area 2500.743, as 3DFACEs, polyface, polymesh (sides only) and MESH; INSERTs,
  // mirrored, scaled and nested, whose true vertices ezdxf gives by virtual_entities.
  const bool ran = run_ezdxf(folder, R"(
n = 24
ring = [(10*math.cos(2*math.pi*i/n), 10*math.sin(2*math.pi*i/n)) for i in range(n)]
low = [(x, y, 0) for x, y in ring]; high = [(x, y, 30) for x, y in ring]
def faces(layout):
    for i in range(n):
        j = (i+1) % n
        layout.add_3dface([low[i], low[j], high[j], high[i]])
        layout.add_3dface([low[j], low[i], (0, 0, 0)]); layout.add_3dface([high[i], high[j], (0, 0, 30)])
for version in ('R12', 'R2000', 'R2010'):
    doc = ezdxf.new(version); doc.header['$INSUNITS'] = 4
    faces(doc.modelspace()); doc.saveas(f'{folder}/face_{version}.dxf')
    doc = ezdxf.new(version); doc.header['$INSUNITS'] = 5
    pf = doc.modelspace().add_polyface()
    pf.append_faces([[low[i], low[(i+1)%n], high[(i+1)%n], high[i]] for i in range(n)])
    pf.append_faces([[low[(i+1)%n], low[i], (0, 0, 0)] for i in range(n)])
    pf.append_faces([[high[i], high[(i+1)%n], (0, 0, 30)] for i in range(n)])
    for v in pf.vertices:
        if v.is_face_record: v.dxf.vtx0 = -abs(v.dxf.vtx0); v.dxf.vtx2 = -abs(v.dxf.vtx2)
    doc.saveas(f'{folder}/polyface_{version}.dxf')
    doc = ezdxf.new(version); doc.header['$INSUNITS'] = 1
    pm = doc.modelspace().add_polymesh(size=(2, n)); pm.close(False, True)
    for i in range(n):
        pm.set_mesh_vertex((0, i), low[i]); pm.set_mesh_vertex((1, i), high[i])
    doc.saveas(f'{folder}/polymesh_{version}.dxf')
for version in ('R2000', 'R2010'):
    doc = ezdxf.new(version); doc.header['$INSUNITS'] = 6
    mesh = doc.modelspace().add_mesh()
    with mesh.edit_data() as data:
        data.vertices = low + high
        data.faces = [[i, (i+1)%n, n+(i+1)%n, n+i] for i in range(n)] + [list(range(n))[::-1], list(range(n, 2*n))]
    doc.saveas(f'{folder}/mesh_{version}.dxf')
    doc = ezdxf.new(version); doc.header['$INSUNITS'] = 4; doc.encoding = 'cp932'
    block = doc.blocks.new('\u90e8\u54c1')  # a name in the code page of the file, or in UTF-8
    for at, level, crease in ((-10, 3, 0), (10, 3, -1), (30, 0, 0)):
        mesh = block.add_mesh(dxfattribs={'subdivision_levels': level})
        with mesh.edit_data() as data:
            data.vertices = [(at + x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
            data.faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            if crease: data.edges = [[0,1],[1,3],[3,2],[2,0],[4,5],[5,7],[7,6],[6,4],[0,4],[1,5],[2,6],[3,7]]
            if crease: data.edge_crease_values = [crease] * 12
    doc.modelspace().add_blockref(block.name, (0, 0, 0))
    doc.saveas(f'{folder}/smooth_{version}.dxf')
doc = ezdxf.new('R2010'); doc.header['$INSUNITS'] = 4
inner = doc.blocks.new('inner', base_point=(1, 2, 3)); faces(inner)
outer = doc.blocks.new('Outer')
outer.add_blockref('INNER', (5, 0, 0), dxfattribs={'xscale': -1, 'yscale': 1.5, 'zscale': 2, 'rotation': 20})
outer.add_3dface([(0, 0, 100), (10, 0, 100), (0, 10, 110)])
msp = doc.modelspace()
msp.add_blockref('OUTER', (100, 50, 25), dxfattribs={'xscale': 2, 'yscale': 2, 'zscale': 2, 'rotation': 30, 'extrusion': (0.3, -0.5, 0.8)})
msp.add_blockref('inner', (0, 300, 0), dxfattribs={'extrusion': (0, 0, -1), 'rotation': 45})
grid = msp.add_blockref('inner', (500, 0, 0), dxfattribs={'row_count': 2, 'column_count': 3, 'row_spacing': 50, 'column_spacing': 60, 'rotation': 90})
doc.saveas(f'{folder}/insert.dxf')
def walk(e):
    if e.dxftype() == '3DFACE': yield from e.wcs_vertices()
    elif e.dxftype() == 'INSERT':
        parts = list(e.multi_insert()) if e.mcount > 1 else [e]
        for p in parts:
            for c in p.virtual_entities(): yield from walk(c)
low_corner = [1e9]*3; high_corner = [-1e9]*3
for e in msp:
    for v in walk(e):
        for k in range(3): low_corner[k] = min(low_corner[k], v[k]); high_corner[k] = max(high_corner[k], v[k])
open(f'{folder}/box.txt', 'w').write(' '.join(map(str, low_corner + high_corner)))
)");
  if (!ran) GTEST_SKIP() << "python3-ezdxf is absent";
  const double cap = 0.5 * 24 * 100 * std::sin(2 * kPi / 24), side = 24 * 2 * 10 * std::sin(kPi / 24) * 30;
  for (const char* version : {"R12", "R2000", "R2010"}) {
    SCOPED_TRACE(version);
    const auto path = [&](const char* kind) { return folder.path() / (std::string(kind) + "_" + version + ".dxf"); };
    const bool unit = std::string(version) != "R12";  // ezdxf leaves the unit out of R12, which does not know it
    EXPECT_NEAR(surface_area(read_cad(path("face"))), 2 * cap + side, 0.01);
    EXPECT_NEAR(signed_volume(read_cad(path("face"))), cap * 30, 0.1);
    EXPECT_NEAR(surface_area(read_cad(path("polyface"), {.unit = LengthUnit::centimetre})), 100 * (2 * cap + side), 1);
    EXPECT_NEAR(surface_area(read_cad(path("polymesh"))), (unit ? 645.16 : 1) * side, unit ? 10 : 0.01);
    if (unit) {
      EXPECT_NEAR(signed_volume(read_cad(path("mesh"))), 1e9 * cap * 30, 1e7);
      const Mesh smooth = read_cad(path("smooth"));
      EXPECT_EQ(smooth.triangles.size(), 2u * 2 * 6 * 64 + 12);
      // Two cubes keep their edges and 8 mm^3 each. The limit of the third lies between balls of the radii at which its
      // corners and its faces end: sqrt(3) / 2 and 272 / 324.
      const double third = signed_volume(smooth) - 16;
      EXPECT_GT(third, 4.0 / 3 * kPi * std::pow(272.0 / 324, 3));
      EXPECT_LT(third, 4.0 / 3 * kPi * std::pow(std::sqrt(0.75), 3));
    }
  }
  const Box box = bounding_box(read_cad(folder.path() / "insert.dxf").vertices);
  std::ifstream truth(folder.path() / "box.txt");
  for (int i = 0; i < 6; ++i) {
    double value = 0;
    truth >> value;
    EXPECT_NEAR(i < 3 ? box.min[i] : box.max[i - 3], value, 1e-3) << i;
  }
}

TEST(ReadDxf, ASmoothPolymeshIsItsFittedPoints) {
  const test::TemporaryFolder folder;
  const auto vertex = [](int flags, double x, double y, double z) {
    return "0\nVERTEX\n8\n0\n10\n" + std::to_string(x) + "\n20\n" + std::to_string(y) + "\n30\n" + std::to_string(z) +
           "\n70\n" + std::to_string(flags) + "\n";
  };
  const std::string head = "\xef\xbb\xbf  0\nSECTION\n2\nENTITIES\n", tail = "0\nSEQEND\n0\nENDSEC\n0\nEOF\n";
  std::string control, fitted;
  for (int i = 0; i < 4; ++i) control += vertex(64 + 16, 10 * (i / 2), 10 * (i % 2), 5);
  for (int i = 0; i < 9; ++i) fitted += vertex(64 + 8, 4 * (i / 3), 4 * (i % 3), 0);
  const std::string sizes = "71\n2\n72\n2\n73\n3\n74\n3\n75\n6\n";
  EXPECT_NEAR(surface_area(read_cad(
                  folder.write("a.dxf", head + "0\nPOLYLINE\n66\n1\n70\n20\n" + sizes + control + fitted + tail))),
              64, 1e-6);
  // Smoothing was asked for, but the writer left its points out: the control points are the surface.
  EXPECT_NEAR(
      surface_area(read_cad(folder.write("b.dxf", head + "0\nPOLYLINE\n66\n1\n70\n20\n" + sizes + control + tail))),
      100, 1e-6);
}

TEST(Convert, GoesFromAnyToAny) {
  const test::TemporaryFolder folder;
  Mesh box;
  test::add_box(box, {0, 0, 0}, {1, 2, 3});
  write_mesh(folder.path() / "a.stl", box);
  EXPECT_EQ(convert(folder.path() / "a.stl", folder.path() / "b.ply").triangles, 12u);
  EXPECT_EQ(convert(folder.path() / "b.ply", folder.path() / "c.dxf").kind, "mesh");
  EXPECT_EQ(convert(folder.path() / "b.ply", folder.path() / "c.xyz").points, 8u);
  EXPECT_THROW(convert(folder.path() / "a.stl", folder.path() / "c.pcd"), Error);
  EXPECT_THROW(convert(folder.path() / "a.stl", folder.path() / "c.step"), Error);
  EXPECT_THROW(convert(folder.path() / "c.xyz", folder.path() / "c.stl"), Error);
}

}  // namespace
}  // namespace tribin
