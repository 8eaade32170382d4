#include <gtest/gtest.h>

#include "recognition/hypotheses.hpp"
#include "support/near_symmetric.hpp"
#include "support/posed_scan.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin {
namespace {

constexpr double kTable = 650;  // mm in front of the camera

/// Lies on the table: z up, towards the camera.
Pose on_table(double x, double y, double turn) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0)) * rotation_from_vector(Vec3(0, 0, turn));
  pose.translation() = Vec3(x, y, kTable);
  return pose;
}

/// Thin and square, so that a piece of floor is like it.
const Part& plate() {
  static const Part part = compile_part(test::prism(test::rectangle(35, 35), 4), {.name = "plate"});
  return part;
}

Scan scan_of(const std::vector<std::pair<const Mesh*, Pose>>& things, unsigned seed) {
  return test::posed_scan(things, Vec3(0, 0, -1), -kTable, 0.1, 0.6, seed, 960, 768);
}

struct FloorShares {
  double table = 0, above = 0;  ///< of the cells on the table, and more than 2 mm above it, those that are floor
};

FloorShares floor_shares(const Scan& scan) {
  const Surfels surfels = surfels_from_scan(scan);
  const Primitives primitives = segment(surfels);
  const PrimitiveModel model = build_model(primitives, surfels);
  SceneFeatures scene = make_scene_features(primitives, model, surfels);
  find_floors(scene, std::span(&plate(), 1), 0.1);
  const Image<std::uint8_t> floor = floor_cells(scene);
  std::array<int, 2> all{}, flagged{};
  for (std::size_t s = 0; s < surfels.cell.size(); ++s) {
    const double height = kTable - double(surfels.position[s].z());
    if (height > 1 && height < 2) continue;
    ++all[height > 2];
    flagged[height > 2] += floor.data[surfels.cell[s]];
  }
  return {double(flagged[0]) / std::max(1, all[0]), double(flagged[1]) / std::max(1, all[1])};
}

/// Bars across each other: what is seen of the table between them is as large as the plate.
std::vector<std::pair<const Mesh*, Pose>> grid_of_bars(unsigned seed) {
  static const Mesh bar = test::prism(test::rectangle(400, 9), 22);
  std::vector<std::pair<const Mesh*, Pose>> out;
  const double turn = 0.1 * seed;
  for (int k = -3; k <= 3; ++k)
    for (const double across : {0.0, kPi / 2}) {
      const double at = 88 * k, a = turn + across;
      out.emplace_back(&bar, on_table(-at * std::sin(a), -at * std::cos(a), a));
    }
  return out;
}

TEST(Floors, AFloorThatBarsCutIntoPiecesIsOneFloorAndNoParts) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const Scan scan = scan_of(grid_of_bars(seed), seed);
    const FloorShares share = floor_shares(scan);
    EXPECT_GT(share.table, 0.8);  // the rest are cells beside edges, which belong to no plane
    EXPECT_EQ(share.above, 0);
    const Found found = find_parts(scan, std::span(&plate(), 1));
    EXPECT_TRUE(found.instances.items.empty());
    EXPECT_TRUE(found.instances.uncertain.empty());
  }
}

TEST(Floors, PlatesThatLieSideBySideAreNone) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    std::vector<std::pair<const Mesh*, Pose>> plates;
    const double turn = 0.1 * seed;
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j) {
        const double x = 76 * i, y = 76 * j;
        plates.emplace_back(&plate().mesh, on_table(x * std::cos(turn) + y * std::sin(turn),
                                                    x * std::sin(turn) - y * std::cos(turn), turn));
      }
    const FloorShares share = floor_shares(scan_of(plates, seed));
    EXPECT_EQ(share.above, 0);
    EXPECT_GT(share.table, 0.8);
  }
}

}  // namespace
}  // namespace tribin
