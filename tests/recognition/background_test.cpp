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

/// Shorter than the part's diameter from its middle to its ends, but longer than any of its faces.
TEST(Walls, AreLongerThanAnyFaceOfThePart) {
  const Mesh cube = test::prism(test::rectangle(26, 26), 52);
  const Mesh wall = test::prism(test::rectangle(3, 50), 60);
  const Part part = compile_part(cube);
  EXPECT_NEAR(part.largest_face_mm, 52 * std::sqrt(2.0), 2);
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const double turn = 0.1 * seed;
    const Scan scan = scan_of({{&wall, on_table(150, 0, 0)}, {&cube, on_table(-110, 10, turn)}}, seed);
    const Surfels surfels = surfels_from_scan(scan);
    const Primitives primitives = segment(surfels);
    const PrimitiveModel model = build_model(primitives, surfels);
    SceneFeatures scene = make_scene_features(primitives, model, surfels);
    find_floors(scene, std::span(&part, 1), 0.1);
    const Image<std::uint8_t> background = background_cells(scene, part);
    std::array<int, 2> all{}, flagged{};  // of the wall's face, of the cube
    for (std::size_t s = 0; s < surfels.size(); ++s) {
      const Vec3f& p = surfels.position[s];
      if (kTable - p.z() < 5 || (p.x() > 0 && kTable - p.z() > 55)) continue;  // the foot, the wall's narrow top
      ++all[p.x() < 0];
      flagged[p.x() < 0] += background.data[surfels.cell[s]];
    }
    ASSERT_GT(all[0], 50);
    ASSERT_GT(all[1], 50);
    EXPECT_GT(flagged[0], 0.7 * all[0]);
    EXPECT_EQ(flagged[1], 0);
  }
}

/// Loud noise spoils normals, so that many cells belong to no primitive.
TEST(Planes, TakeInTheCellsBesideThemThatLieInThem) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    constexpr double kSigma = 0.6;
    const Scan scan = test::posed_scan(grid_of_bars(seed), Vec3(0, 0, -1), -kTable, kSigma, 1.5, seed, 960, 768);
    const Surfels surfels = surfels_from_scan(scan);
    const Primitives primitives = segment(surfels);
    const PrimitiveModel model = build_model(primitives, surfels);
    const SceneFeatures scene = make_scene_features(primitives, model, surfels);
    int spoiled = 0, taken = 0;
    for (std::size_t s = 0; s < surfels.size(); ++s) {
      const std::int32_t label = primitives.label_of_surfel[s], now = scene.label_of_cell.data[surfels.cell[s]];
      if (label != 0) {
        EXPECT_EQ(now, label);
        continue;
      }
      if (kTable - surfels.position[s].z() < 2 * kSigma) {
        ++spoiled;
        taken += now != 0;
      }
      if (now == 0) continue;
      const Primitive& plane = primitives.items[static_cast<std::size_t>(now) - 1];
      EXPECT_EQ(plane.type, PrimitiveType::plane);
      EXPECT_LT(std::abs(plane.axis.dot(surfels.position[s].cast<double>()) - plane.offset_mm), 5 * kSigma);
    }
    ASSERT_GT(spoiled, 100);
    EXPECT_GT(taken, spoiled / 3);  // the others mix the table with the foot of a bar
  }
}

}  // namespace
}  // namespace tribin
