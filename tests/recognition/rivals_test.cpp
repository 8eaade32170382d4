#include "recognition/rivals.hpp"

#include <gtest/gtest.h>

#include "support/near_symmetric.hpp"
#include "support/posed_scan.hpp"

namespace tribin {
namespace {

TEST(Turned, IsUndoneByTheAngleThatIsRead) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-3, 3);
  for (int i = 0; i < 100; ++i) {
    const ContinuousSymmetry line{2 * test::random_direction(random), 30 * test::random_direction(random)};
    const double a = angle(random);
    EXPECT_NEAR(angle_about(line, turned(Pose::Identity(), line, a)), a, 1e-9);
    const Pose at = turned(Pose::Identity(), line, a);
    EXPECT_LT((at * line.point - line.point).norm(), 1e-9);
  }
}

/// Lies on the table at 650 mm below the camera, z up, turned by chance.
Pose on_table(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> turn(0, 2 * kPi);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0)) * rotation_from_vector(Vec3(0, 0, turn(random)));
  pose.translation() = Vec3(0, 0, 650);
  return pose;
}

/// Of a block that lies on the table only the top is seen. A search that took a narrower face for it, flush with one of
/// its edges, is led back.
TEST(Rivals, AnotherFaceFlushWithTheOneThatIsSeenIsOne) {
  const Mesh block = test::prism(test::rectangle(45, 26), 37);  // faces of 90 x 52, 90 x 37, 52 x 37
  const Part part = compile_part(block);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Pose truth = on_table(seed);
    const Scan scan = test::posed_scan({{&block, truth}}, Vec3(0, 0, -1), -650, 0.1, 0.6, seed);
    const Surfels surfels = surfels_from_scan(scan);
    const SceneDepth scene = make_scene_depth(scan, surfels);
    // On its side, the upper edges of one long side where they are.
    Pose on_side = Pose::Identity();
    on_side.linear() = rotation_from_vector(Vec3(kPi / 2, 0, 0));
    on_side.translation() = Vec3(0, 26, 37 - 26);
    const Pose wrong = truth * on_side;
    ASSERT_FALSE(close_poses(part, wrong, truth, 0.05 * part.diameter_mm, 5 * kDegree));
    const std::vector<Pose> found = rivals(scene, part, wrong);
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const Pose& pose) {
      return close_poses(part, pose, truth, 0.02 * part.diameter_mm, 1 * kDegree);
    }));
  }
}

/// Of a block half of which lies under a plate as much is seen as of one that stands on end beside the plate: the first
/// is a rival of the second, though it shows a smaller share of itself.
TEST(Rivals, AreThoseThatExplainAsMuchThoughMoreOfThemIsHidden) {
  const Mesh block = test::prism(test::rectangle(45, 26), 37);
  const Mesh plate = test::prism(test::rectangle(60, 60), 3);
  const Part part = compile_part(block);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Pose truth = on_table(seed);
    constexpr double kEnd = -8;  // of what the plate leaves of the upper face: 37 of 90 mm
    Pose above = Pose::Identity();
    above.translation() = Vec3(kEnd + 60, 0, 47);
    const Scan scan =
        test::posed_scan({{&block, truth}, {&plate, truth * above}}, Vec3(0, 0, -1), -650, 0.1, 0.6, seed);
    const Surfels surfels = surfels_from_scan(scan);
    const SceneDepth scene = make_scene_depth(scan, surfels);
    Pose on_end = Pose::Identity();  // x up, z along -x
    on_end.linear() << 0, 0, -1, 0, 1, 0, 1, 0, 0;
    on_end.translation() = Vec3(kEnd, 0, 37 - 45);
    const std::vector<Pose> found = rivals(scene, part, truth * on_end);
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const Pose& pose) {
      return close_poses(part, pose, truth, 0.02 * part.diameter_mm, 1 * kDegree);
    }));
  }
}

}  // namespace
}  // namespace tribin
