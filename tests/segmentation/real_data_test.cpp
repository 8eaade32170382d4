#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "segmentation/boundary.hpp"
#include "support/mosd.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/io/scan_files.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

// The rectified left camera of the gearbox scan, as its README gives it.
constexpr const char* kGearboxCamera = R"({"fx": 4593.1058, "fy": 4593.1058, "cx": 336.2831, "cy": 760.3019,
                                           "depth_scale": 0.05})";
constexpr int kBust = 1150;  // columns beyond it show a plaster bust

/// Radius of the circle through those points of a rim, within 4 pixels of its circle, that lie on one side of its
/// middle.
double half_radius(const BoundaryLoop& loop, const Vec3& normal, bool left, double pitch_mm) {
  std::vector<Vec3f> half;
  for (const Vec3f& p : loop.points) {
    const Vec3 q = p.cast<double>() - loop.circle->center;
    if ((q.x() < 0) == left && std::abs(q.norm() - loop.circle->radius_mm) < 4.0 * pitch_mm) half.push_back(p);
  }
  const std::optional<BoundaryCircle> circle = segmentation_detail::fit_boundary_circle(half, normal, pitch_mm);
  return circle ? circle->radius_mm : -1;
}

TEST(RealGearbox, HolesAreCirclesAndTheBustIsNoCylinder) {
  const std::filesystem::path depth = test::shared_data("real/gearbox_stereo/derived_depth_rectL_0.05mm.png");
  TRIBIN_NEED_DATA(depth);
  const test::TemporaryFolder folder;
  const Scan scan = read_scan(depth, {.camera_file = folder.write("camera.json", kGearboxCamera)});
  const Surfels surfels = surfels_from_scan(scan);
  const Primitives found = segment(surfels);

  int holes = 0, cylinders = 0;
  for (const Primitive& p : found.items) {
    if (p.type == PrimitiveType::cylinder) {
      double column = 0;
      for (std::uint32_t i : p.surfels)
        column += static_cast<double>(surfels.cell[i] % static_cast<std::uint32_t>(surfels.surfel_of_cell.width));
      cylinders += column * surfels.cell_px / static_cast<double>(p.surfels.size()) > kBust;
    }
    for (const BoundaryLoop& loop : p.loops) {
      if (!loop.inner || !loop.circle || loop.circle->radius_mm < 10) continue;
      if (loop.circle->rms_mm > 0.6 || loop.circle->arc < 270 * kDegree) continue;
      const double pitch = p.point.z() / scan.camera.fx;
      EXPECT_NEAR(half_radius(loop, p.axis, true, pitch), half_radius(loop, p.axis, false, pitch), 0.5);
      ++holes;
    }
  }
  EXPECT_EQ(holes, 2);
  EXPECT_LE(cylinders, 2);
}

struct LabelledPart {
  const char* scan;
  std::uint32_t label;
  bool end_cap;  ///< the label holds the part's flat or dented end as well: judged by the side alone
};

/// Pixels whose surfel looks along the axis: the end of a body, by normals alone.
bool on_end(const Surfels& s, int u, int v, const Vec3& axis) {
  const int column = u / s.cell_px, row = v / s.cell_px;
  if (!s.surfel_of_cell.contains(column, row) || s.surfel_of_cell(column, row) < 0) return false;
  const Vec3f& n = s.normal[static_cast<std::size_t>(s.surfel_of_cell(column, row))];
  return std::abs(n.cast<double>().dot(axis)) > std::cos(45 * kDegree);
}

TEST(RealMosd, LabelledCylindersAndTheTable) {
  const LabelledPart parts[] = {{"test31", 20, true},  {"test31", 30, true},   {"test31", 40, false},
                                {"test35", 30, true},  {"test35", 40, false},  {"test35", 50, false},
                                {"learn33", 30, true}, {"learn33", 50, false}, {"learn33", 61, false}};
  for (const char* name : {"test31", "test35", "learn33", "test0"}) {
    SCOPED_TRACE(name);
    const std::filesystem::path path = test::shared_data(std::string("real/mosd/") + name + ".pcd");
    TRIBIN_NEED_DATA(path);
    const Scan scan = read_scan(path);
    const Image<std::uint32_t> truth = test::mosd_labels(path, scan.width(), scan.height());
    const Surfels surfels = surfels_from_scan(scan);
    const Primitives found = segment(surfels);
    const Image<std::uint16_t> ours = label_pixels(found, surfels);

    std::map<int, int> table;
    int table_pixels = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      if (truth.data[i] == 1) ++table_pixels, ++table[ours.data[i]];
    ASSERT_FALSE(found.items.empty());
    EXPECT_EQ(found.items[0].type, PrimitiveType::plane);
    EXPECT_GE(table[1], 0.9 * table_pixels);

    for (const LabelledPart& part : parts) {
      if (std::string(part.scan) != name) continue;
      SCOPED_TRACE(part.label);
      double best = 0;
      for (const Primitive& p : found.items) {
        if (p.type != PrimitiveType::cylinder) continue;
        int both = 0, either = 0;
        for (int v = 0; v < scan.height(); ++v)
          for (int u = 0; u < scan.width(); ++u) {
            const bool in_truth =
                truth(u, v) == part.label && !(part.end_cap && ours(u, v) != p.id && on_end(surfels, u, v, p.axis));
            both += in_truth && ours(u, v) == p.id;
            either += in_truth || ours(u, v) == p.id;
          }
        if (both > 0) best = std::max(best, static_cast<double>(both) / either);
      }
      EXPECT_GE(best, 0.7);
      RecordProperty(std::string(name) + "_" + std::to_string(part.label), std::to_string(best));
    }
  }
}

}  // namespace
}  // namespace tribin
