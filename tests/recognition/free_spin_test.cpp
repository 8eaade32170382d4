#include <gtest/gtest.h>

#include "support/near_symmetric.hpp"
#include "support/posed_scan.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin {
namespace {

/// A wheel of 24 teeth that only a boss underneath tells the turns of.
Mesh wheel_with_hidden_boss() {
  test::Outline teeth;
  for (int k = 0; k < 24; ++k)
    for (const auto& [share, radius] : {std::pair{0.0, 30.0}, {0.35, 30.0}, {0.5, 26.0}, {0.85, 26.0}}) {
      const double angle = 2 * kPi * (k + share) / 24;
      teeth.push_back(radius * Vec2(std::cos(angle), std::sin(angle)));
    }
  Mesh mesh = test::prism(teeth, 14);
  const Mesh boss = test::moved(test::box(12, 6, 5), Pose(Eigen::Translation3d(14, 0, -2.5)));
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), boss.vertices.begin(), boss.vertices.end());
  for (const auto& t : boss.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return mesh;
}

TEST(FreeSpin, GivesOutAWheelWhoseToothIsNotToldOnlyWhereItsSpinIsFree) {
  std::vector<Part> parts = {compile_part(wheel_with_hidden_boss(), {"wheel"})};
  const Part& wheel = parts[0];
  ASSERT_FALSE(wheel.nearly_round.empty());
  Pose truth = Pose::Identity();  // seen from above, a little tilted: the boss is behind
  truth.linear() =
      (Eigen::AngleAxisd(kPi - 0.2, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  truth.translation() = Eigen::Vector3d(12, -7, 600);
  Scan scan;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    scan = test::posed_scan({{&wheel.mesh, truth}}, Vec3(0, 0, -1), -700, 0.1, 0.8, seed, 800, 640);
    const Found kept_back = find_parts(scan, parts);
    EXPECT_TRUE(kept_back.instances.items.empty());
    ASSERT_EQ(kept_back.instances.uncertain.size(), 1u);
    EXPECT_GE(kept_back.instances.uncertain[0].alternatives.size(), 15u);
  }

  declare_free_spin(parts[0]);
  const Found found = find_parts(scan, parts);
  ASSERT_EQ(found.instances.items.size(), 1u);
  const Instance& instance = found.instances.items[0];
  EXPECT_TRUE(instance.alternatives.empty());
  ASSERT_EQ(instance.free_directions.size(), 1u);
  const Eigen::Matrix<double, 6, 1> free = instance.free_directions[0];
  EXPECT_LT((Eigen::Matrix<double, 6, 6>(instance.covariance) * free).norm(), 1e-9);
  EXPECT_GT(instance.score, 0.8);
  // At its place, and tooth on tooth.
  const Eigen::Vector3d c = wheel.box_center() - Vec3(0, 0, wheel.box_center().z());
  EXPECT_LT((instance.camera_from_part * c - truth * c).norm(), 0.1);
  const Eigen::Matrix3d turn = truth.linear().transpose() * instance.camera_from_part.linear();
  EXPECT_LT(std::acos(std::min(1.0, turn(2, 2))), 0.2 * kDegree);
  EXPECT_LT(std::abs(std::remainder(std::atan2(turn(1, 0), turn(0, 0)), 2 * kPi / 24)), 0.3 * kDegree);
}

}  // namespace
}  // namespace tribin
