#include "tribin/cad_exchange/read_step.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

namespace fs = std::filesystem;

std::string data(const std::string& name) {
  const char* root = std::getenv("TRIBIN_DATA");
  return (fs::path(root ? root : TRIBIN_SOURCE_DIR "/../shared/data") / name).string();
}

#define NEED_FILE(path) \
  if (!fs::exists(path)) GTEST_SKIP() << path << " is not there (set TRIBIN_DATA)"

/// Edges that do not have exactly one triangle on each side.
int open_edges(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const auto a = t[k], b = t[(k + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  int open = 0;
  for (const auto& [edge, sum] : balance) open += sum != 0;
  return open;
}

double volume(const Mesh& mesh) {
  double v = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>();
    v += a.dot(b.cross(Vec3(mesh.vertices[t[2]].cast<double>()))) / 6;
  }
  return v;
}

/// Distance of a point from the exact surface of a face (planes, cylinders, cones, spheres, tori).
double distance(const CadFace& f, const Vec3& p) {
  const Vec3 d = p - f.point;
  const double along = d.dot(f.axis), across = (d - along * f.axis).norm();
  switch (f.type) {
    case SurfaceType::plane:
      return std::abs(along);
    case SurfaceType::cylinder:
      return std::abs(across - f.radius_mm);
    case SurfaceType::cone:
      return std::abs(across * std::cos(f.half_angle) - along * std::sin(f.half_angle));
    case SurfaceType::sphere:
      return std::abs(d.norm() - f.radius_mm);
    case SurfaceType::torus:
      // A tube thicker than its ring meets itself on the axis: the far side of the tube is a surface too.
      return std::min(std::abs(std::hypot(across - f.radius_mm, along) - f.minor_radius_mm),
                      std::abs(std::hypot(across + f.radius_mm, along) - f.minor_radius_mm));
    default:
      return 0;
  }
}

/// Does the triangle's normal agree with what the face says of its outward side?
double side(const CadFace& f, const Vec3& centre, const Vec3& normal) {
  const Vec3 d = centre - f.point;
  Vec3 outwards = d - d.dot(f.axis) * f.axis;
  if (f.type == SurfaceType::plane) return normal.dot(f.axis);
  if (f.type == SurfaceType::sphere) outwards = d;
  if (f.type == SurfaceType::torus) outwards = d - outwards.normalized() * f.radius_mm;
  if (f.type == SurfaceType::free_form) return 1;
  return normal.dot(outwards.normalized()) * (f.concave ? -1 : 1);
}

/// What holds for any part that is read.
/// `share`: of triangles that may break it, where the file itself is loose at its edges.
void expect_sound(const Mesh& mesh, double share = 0) {
  ASSERT_EQ(mesh.face_of_triangle.size(), mesh.triangles.size());
  ASSERT_GT(mesh.faces.size(), 0u);
  int wrong_side = 0;
  int off = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const CadFace& f = mesh.faces.at(mesh.face_of_triangle[i] - 1);
    ASSERT_EQ(f.id, mesh.face_of_triangle[i]);
    Vec3 v[3];
    for (int k = 0; k < 3; ++k) v[k] = mesh.vertices.at(mesh.triangles[i][k]).cast<double>();
    for (const Vec3& p : v) off += distance(f, p) > mesh.chord_error_mm / 10;
    const Vec3 normal = (v[1] - v[0]).cross(v[2] - v[0]);
    if (normal.norm() < 1e-3) continue;  // slivers have no direction to speak of
    wrong_side += side(f, (v[0] + v[1] + v[2]) / 3, normal.normalized()) < 0;
  }
  const double allowed = share * static_cast<double>(mesh.triangles.size());
  EXPECT_LE(off, allowed) << "vertices lie on the exact surfaces";
  EXPECT_LE(wrong_side, allowed) << "triangles look to the side that the exact face calls outward";
}

int count(const Mesh& mesh, SurfaceType type, double radius, bool concave) {
  int n = 0;
  for (const CadFace& f : mesh.faces)
    n += f.type == type && f.concave == concave && std::abs(f.radius_mm - radius) < 1e-6;
  return n;
}

TEST(ReadStep, AlternatorsAreClosedAndExact) {
  for (const std::string name : {"alternator_a", "alternator_b"}) {
    const std::string path = data("scenes_dev/cad/" + name + ".step");
    NEED_FILE(path);
    const Mesh mesh = read_step(path);
    SCOPED_TRACE(name);
    expect_sound(mesh);
    EXPECT_EQ(mesh.name, name);
    EXPECT_EQ(open_edges(mesh), 0);
    EXPECT_TRUE(mesh.oriented);
    EXPECT_GT(volume(mesh), 0);
    EXPECT_LE(mesh.triangles.size(), 20000u);
    RecordProperty(name + "_triangles", static_cast<int>(mesh.triangles.size()));
  }
  const Mesh a = read_step(data("scenes_dev/cad/alternator_a.step"));
  EXPECT_GE(count(a, SurfaceType::cylinder, 60, false), 1);  // the housing's barrel
}

TEST(ReadStep, TheSameBytesEachTime) {
  const std::string path = data("scenes_dev/cad/alternator_b.step");
  NEED_FILE(path);
  const Mesh a = read_step(path), b = read_step(path);
  EXPECT_EQ(a.triangles, b.triangles);
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  for (std::size_t i = 0; i < a.vertices.size(); ++i) EXPECT_EQ(a.vertices[i], b.vertices[i]);
}

TEST(ReadStep, ReadsPartsOfManyWriters) {
  for (const std::string name :
       {"occt/as1-tu-203.stp", "occt/bm2_ec_lever-A.stp", "occt/component8.step", "occt/ec_exhaust-A.stp",
        "occt/linkrods.step", "occt/screw.step", "occt/trj6_as1-ec-214.stp", "occt/trj6_pm4-ec-203.stp",
        "occt/xr1-tc-plt.stp", "o2ac/02-PANEL.step", "o2ac/03-PANEL2.step", "o2ac/suction_tool_phi10.step"}) {
    const std::string path = data("cad/" + name);
    NEED_FILE(path);
    SCOPED_TRACE(name);
    const Mesh mesh = read_step(path, {.chord_error_mm = 0.1});
    expect_sound(mesh, 0.03);
    EXPECT_TRUE(mesh.oriented);
    EXPECT_GT(volume(mesh), 0);
    int named = 0;
    for (const CadFace& f : mesh.faces) named += f.type != SurfaceType::free_form;
    EXPECT_GE(2 * named, static_cast<int>(mesh.faces.size())) << "most faces of machine parts have an exact surface";
  }
}

TEST(ReadStep, AnAssemblyIsOneRigidPartWhoeverWroteIt) {
  const std::string path = data("cad/occt/trj6_as1-ec-214.stp");
  NEED_FILE(path);
  const Mesh elementary = read_step(path), splines = read_step(data("cad/occt/as1-tu-203.stp"));
  const auto cylinders = [](const Mesh& mesh, bool concave) {
    int n = 0;
    for (const CadFace& f : mesh.faces) n += f.type == SurfaceType::cylinder && f.concave == concave;
    return n;
  };
  // One writer has cylinders, the other splines that are cylinders.
  EXPECT_GT(cylinders(elementary, false), 10);
  EXPECT_GT(cylinders(elementary, true), 10);
  EXPECT_EQ(cylinders(elementary, false), cylinders(splines, false));
  EXPECT_EQ(cylinders(elementary, true), cylinders(splines, true));
  EXPECT_NEAR(volume(elementary), volume(splines), 0.01 * volume(splines));  // the same bracket, nuts and bolts
}

TEST(ReadIges, FindsConesAndCylinders) {
  for (const std::string name : {"OCC8842_cone_CATIA.igs", "OCC8842_cylinder_CATIA.igs", "bearing.iges"}) {
    const std::string path = data("cad/iges/" + name);
    NEED_FILE(path);
    SCOPED_TRACE(name);
    const Mesh mesh = read_iges(path, {.chord_error_mm = 0.1});
    expect_sound(mesh, 0.02);
    std::map<SurfaceType, int> types;
    for (const CadFace& f : mesh.faces) ++types[f.type];
    EXPECT_TRUE(name.find("cone") == std::string::npos || types[SurfaceType::cone] > 0);
    EXPECT_TRUE(name.find("cylinder") == std::string::npos || types[SurfaceType::cylinder] > 0);
  }
}

TEST(ReadStep, RefusesWhatIsNoStepFile) {
  const fs::path dir = fs::temp_directory_path() / "tribin_read_step";
  fs::create_directories(dir);
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(dir / name, std::ios::binary) << text;
    return (dir / name).string();
  };
  const auto refused = [](const std::string& path) {
    try {
      read_step(path);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(e.what()).find(path), std::string::npos) << e.what();
      return true;
    }
    return false;
  };
  EXPECT_TRUE(refused((dir / "absent.step").string()));
  EXPECT_TRUE(refused(dir.string()));
  EXPECT_TRUE(refused(write("empty.step", "")));
  EXPECT_TRUE(refused(write("text.step", "solid of another kind")));
  EXPECT_TRUE(refused(write("head.step", "ISO-10303-21;\nHEADER;\n")));
  EXPECT_TRUE(refused(write("nothing.step", "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")));
  const std::string whole = data("scenes_dev/cad/alternator_a.step");
  if (fs::exists(whole)) {
    std::ifstream in(whole, std::ios::binary);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    EXPECT_TRUE(refused(write("cut.step", text.substr(0, text.size() / 2))));
  }
  EXPECT_THROW(read_step(whole, {.chord_error_mm = -1}), Error);
  fs::remove_all(dir);
}

}  // namespace
}  // namespace tribin
