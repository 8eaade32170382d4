// One part in many formats is one part; each file of the shared CAD opens or is refused with the right sentence.
#include <gtest/gtest.h>

#include <IGESControl_Writer.hxx>
#include <STEPControl_Reader.hxx>
#include <algorithm>
#include <cmath>
#include <map>

#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/cad_exchange/read_step.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/convert.hpp"
#include "tribin/segmentation/primitives.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {
namespace {

namespace fs = std::filesystem;
const fs::path kParts = TRIBIN_SOURCE_DIR "/examples/parts";

std::vector<Primitive> primitives_of(const fs::path& file) {
  const Mesh mesh = read_cad(file);
  return segment(surfels_from_mesh(mesh)).items;
}

double total_area(const std::vector<Primitive>& primitives) {
  double sum = 0;
  for (const Primitive& p : primitives) sum += p.area_mm2;
  return sum;
}

/// How far two primitives of one type and side are apart where they carry surface [mm]; infinite if they are not alike.
double apart_mm(const Primitive& a, const Primitive& b) {
  constexpr double kNever = 1e300;
  if (a.type != b.type || (a.type != PrimitiveType::plane && a.concave != b.concave)) return kNever;
  if (a.type == PrimitiveType::torus)
    return std::max({(a.point - b.point).norm(), std::abs(a.radius_mm - b.radius_mm),
                     std::abs(a.minor_radius_mm - b.minor_radius_mm), a.axis.cross(b.axis).norm() * a.radius_mm});
  if (a.type == PrimitiveType::sphere) return std::max((a.point - b.point).norm(), std::abs(a.radius_mm - b.radius_mm));
  if (a.type != PrimitiveType::cylinder && a.axis.dot(b.axis) < 0) return kNever;  // the other side
  const double angle = a.axis.cross(b.axis).norm();
  if (a.type == PrimitiveType::plane)
    return std::max(std::abs(a.axis.dot(b.point - a.point)), angle * std::sqrt(a.area_mm2));
  const Vec3 d = b.point - a.point;
  if (a.type == PrimitiveType::cone) {
    // The apex of a flat cone slides along the axis: what counts is the distance of the surfaces.
    const double farthest = std::max(std::abs(a.extent_min), std::abs(a.extent_max)) / std::cos(a.half_angle);
    return std::max({(d - a.axis * a.axis.dot(d)).norm(), std::abs(a.axis.dot(d)) * std::sin(a.half_angle),
                     (angle + std::abs(a.half_angle - b.half_angle)) * farthest});
  }
  return std::max(
      {(d - a.axis * a.axis.dot(d)).norm(), std::abs(a.radius_mm - b.radius_mm), angle * 0.5 * a.height_mm()});
}

/// Each primitive of `a` of some size has one in `b` within `limit`.
void expect_contained(const std::vector<Primitive>& a, const std::vector<Primitive>& b, double limit,
                      const char* direction) {
  const double least = 2e-3 * total_area(a);
  for (const Primitive& p : a) {
    if (p.area_mm2 < least) continue;
    if (p.type == PrimitiveType::torus) continue;  // Not yet all on triangles: see IsTheSameInAnyTessellation
    double nearest = 1e300;
    for (const Primitive& q : b) nearest = std::min(nearest, apart_mm(p, q));
    EXPECT_LE(nearest, limit) << direction << ": " << name_of(p.type) << " " << p.id << ", " << p.area_mm2 << " mm2, r "
                              << p.radius_mm << ", half angle " << p.half_angle / kDegree << ", axis "
                              << p.axis.transpose() << ", at " << p.point.transpose();
  }
}

void expect_same(const std::vector<Primitive>& truth, const std::vector<Primitive>& seen, double limit) {
  expect_contained(truth, seen, limit, "lost");
  expect_contained(seen, truth, limit, "invented");
}

void write_iges(const fs::path& step, const fs::path& iges, int mode) {
  STEPControl_Reader reader;
  ASSERT_EQ(reader.ReadFile(step.c_str()), IFSelect_RetDone);
  reader.TransferRoots();
  IGESControl_Writer writer("MM", mode);
  writer.AddShape(reader.OneShape());
  writer.ComputeModel();
  ASSERT_TRUE(writer.Write(iges.c_str()));
}

std::vector<fs::path> sample_parts() {
  std::vector<fs::path> parts = {kParts / "alternator_a.step", kParts / "alternator_b.step"};
  for (const char* name : {"cad/o2ac/03-PANEL2.step", "cad/o2ac/02-PANEL.step", "cad/occt/bm2_ec_lever-A.stp",
                           "cad/occt/screw.step", "cad/occt/xr1-tc-plt.stp"})
    if (const fs::path path = test::shared_data(name); fs::exists(path)) parts.push_back(path);
  return parts;
}

TEST(OnePart, IsTheSameAsStepAndAsIgesInBothModes) {
  register_cad_exchange();
  const test::TemporaryFolder folder;
  for (const fs::path& step : sample_parts()) {
    SCOPED_TRACE(step);
    const std::vector<Primitive> truth = primitives_of(step);
    for (const int mode : {0, 1}) {  // loose faces, whose cylinders are surfaces of revolution; solids
      SCOPED_TRACE(mode);
      const fs::path iges = folder.path() / "part.igs";
      write_iges(step, iges, mode);
      const Mesh mesh = read_iges(iges.string());
      EXPECT_TRUE(mesh.oriented);
      EXPECT_GT(signed_volume(mesh), 0);
      expect_same(truth, primitives_of(iges), 1e-3);
    }
  }
}

TEST(OnePart, IsTheSameAsStepAndAsTriangles) {
  register_cad_exchange();
  const test::TemporaryFolder folder;
  for (const fs::path& step : sample_parts()) {
    SCOPED_TRACE(step);
    const std::vector<Primitive> truth = primitives_of(step);
    for (const char* extension : {".stl", ".dxf"}) {  // PLY and OBJ hold the same triangles: ReadCad tests them
      SCOPED_TRACE(extension);
      const fs::path other = folder.path() / (std::string("part") + extension);
      convert(step, other);
      expect_same(truth, primitives_of(other), TessellationOptions{}.chord_error_mm);
    }
  }
}

/// Area of the primitives of `truth` that `seen` explains by the same surfaces, triangle by triangle, over their area;
/// and the other way round, over what lies on elementary faces at all.
struct Agreement {
  double found = 0, right = 0;
};

Agreement agreement(const Mesh& mesh, double limit) {
  Mesh bare = mesh;
  bare.faces.clear();
  bare.face_of_triangle.clear();
  const Surfels exact = surfels_from_mesh(mesh), triangles = surfels_from_mesh(bare);
  const Primitives truth = segment(exact), seen = segment(triangles);
  double both = 0, of_truth = 0, of_seen = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int a = truth.label_of_surfel[t], b = seen.label_of_surfel[t];
    if (a == 0) continue;
    of_truth += exact.area_mm2[t];
    if (b == 0) continue;
    of_seen += exact.area_mm2[t];
    if (apart_mm(truth.items[static_cast<std::size_t>(a - 1)], seen.items[static_cast<std::size_t>(b - 1)]) <= limit)
      both += exact.area_mm2[t];
  }
  return {both / of_truth, both / of_seen};
}

TEST(OnePart, IsTheSameInAnyTessellation) {
  for (const fs::path& step : sample_parts())
    for (const double chord_mm : {0.02, 0.1, 0.5})
      for (const double angle : {10 * kDegree, 20 * kDegree}) {
        SCOPED_TRACE(step.string() + ", chord " + std::to_string(chord_mm) + ", angle " + std::to_string(angle));
        const Mesh mesh = read_step(step, {.chord_error_mm = chord_mm, .angle = angle});
        const Agreement a = agreement(mesh, std::max(mesh.chord_error_mm, 1e-3));
        // Where the mesher spans a quarter of a fillet by one facet nothing is left of its roundness.
        EXPECT_GE(a.found, chord_mm < 0.05 ? 0.98 : 0.90);
        EXPECT_GE(a.right, 0.97);
      }
}

TEST(OnePart, AssemblyOfTrueCylindersAndOfSplines) {
  register_cad_exchange();
  const fs::path elementary = test::shared_data("cad/occt/trj6_as1-ec-214.stp"),
                 splines = test::shared_data("cad/occt/as1-tu-203.stp");
  TRIBIN_NEED_DATA(elementary);
  // The files lie on each other as they are. 28 cylindric faces of 5 parts stand in the one, none in the other; the
  // assembly places them 70 times, two halves each, and holes that go on through plate and bracket are one: 35.
  const std::vector<Primitive> a = primitives_of(elementary), b = primitives_of(splines);
  const auto cylinders = [](const std::vector<Primitive>& all) {
    std::vector<Primitive> out;
    for (const Primitive& p : all)
      if (p.type == PrimitiveType::cylinder) out.push_back(p);
    return out;
  };
  ASSERT_EQ(cylinders(a).size(), 35u);
  ASSERT_EQ(cylinders(b).size(), 35u);
  std::vector<bool> used(b.size(), false);
  for (const Primitive& p : cylinders(a)) {
    std::size_t best = b.size();
    for (std::size_t k = 0; k < b.size(); ++k)
      if (!used[k] && apart_mm(p, b[k]) < 0.02 && (p.point - b[k].point).norm() < 0.02 &&
          std::abs(p.height_mm() - b[k].height_mm()) < 0.02)
        best = k;
    ASSERT_LT(best, b.size()) << "cylinder " << p.id << " at " << p.point.transpose();
    used[best] = true;
  }
}

TEST(Units, AreTheFilesOwn) {
  register_cad_exchange();
  const fs::path metres = test::shared_data("cad/occt/bm2_ec_lever-A.stp");
  TRIBIN_NEED_DATA(metres);
  // Written in metres.
  EXPECT_LT((bounding_box(read_cad(metres).vertices).size() - Vec3(235, 249.9, 86)).cwiseAbs().maxCoeff(), 0.01);
}

struct Expected {
  ErrorCode code = ErrorCode::bad_input;
  std::string words;
};

TEST(SharedCad, EachFileOpensOrIsRefusedWithTheRightSentence) {
  register_cad_exchange();
  const fs::path root = test::shared_data("cad");
  TRIBIN_NEED_DATA(root);
  // Solids in ACIS' own format are not read; all else opens.
  const std::map<std::string, Expected> refused = {
      {"ezdxf_uncommon.dxf", {ErrorCode::bad_input, "3DSOLID (ACIS data, not supported)"}},
      {"libredwg_2004_Surface.dxf", {ErrorCode::bad_input, "EXTRUDEDSURFACE (ACIS data, not supported)"}},
      {"libredwg_example_2000.dxf", {ErrorCode::bad_input, "3DSOLID (ACIS data, not supported)"}},
  };
  const std::vector<std::string> extensions = cad_extensions();
  int opened = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    const std::string extension = entry.path().extension();
    if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) continue;
    SCOPED_TRACE(entry.path());
    const auto expected = refused.find(entry.path().filename());
    try {
      const Mesh mesh = read_cad(entry.path());
      ++opened;
      EXPECT_EQ(expected, refused.end()) << "was read";
      EXPECT_FALSE(mesh.triangles.empty());
      EXPECT_GT(surface_area(mesh), 0);
      if (!mesh.faces.empty()) {
        EXPECT_TRUE(mesh.oriented);
      }
    } catch (const Error& error) {
      ASSERT_NE(expected, refused.end()) << error.what();
      EXPECT_EQ(error.code(), expected->second.code);
      EXPECT_NE(std::string(error.what()).find(expected->second.words), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find(entry.path()), 0u) << error.what();
    }
  }
  EXPECT_GE(opened, 40);
}

}  // namespace
}  // namespace tribin
