#include <gtest/gtest.h>

#include "part/shapes.hpp"
#include "tribin/core/error.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin {
namespace {

Pose turn_about_z(double angle) {
  Pose out = Pose::Identity();
  out.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return out;
}

Part part_of(const SymmetryGroup& own) {
  Part part;
  part.name = "thing";
  part.diameter_mm = 100;
  part.box_min = Vec3(-30, -30, -20), part.box_max = Vec3(30, 30, 20);
  part.symmetry = own;
  return part;
}

TEST(DeclaredSymmetry, AddsToThePartsOwnAndLeavesOutWhatItHas) {
  Part part = part_of({{Pose::Identity(), turn_about_z(kPi)}, {}});
  declare_symmetry(part, {{Pose::Identity(), turn_about_z(kPi), turn_about_z(kPi / 2)}, {}});
  EXPECT_EQ(part.declared.discrete.size(), 2u);  // the identity and the quarter turn
  EXPECT_EQ(part.symmetry.discrete.size(), 2u);
  const SymmetryGroup all = all_symmetries(part);
  EXPECT_EQ(all.discrete.size(), 4u);  // half turn times quarter turn is a turn of its own
  for (int k = 0; k < 4; ++k)
    EXPECT_TRUE(same_placing(part, all, Pose::Identity(), turn_about_z(k * kPi / 2), 0.1, 0.1 * kDegree));
  EXPECT_FALSE(same_placing(part, all, Pose::Identity(), turn_about_z(kPi / 4), 0.1, 0.1 * kDegree));
  EXPECT_FALSE(same_placing(part, part.symmetry, Pose::Identity(), turn_about_z(kPi / 2), 0.1, 0.1 * kDegree));
}

TEST(DeclaredSymmetry, AFreeSpinMakesAllTurnsAboutTheAxisOne) {
  Part part = part_of({{Pose::Identity()}, {}});
  EXPECT_THROW(declare_free_spin(part), Error);  // round about nothing
  part.nearly_round = {{Vec3::UnitZ(), Vec3(5, 0, 0)}};
  declare_free_spin(part);
  declare_free_spin(part);  // twice is once
  const SymmetryGroup all = all_symmetries(part);
  ASSERT_EQ(all.continuous.size(), 1u);
  Pose about = Pose(Eigen::Translation3d(5, 0, 0)) * turn_about_z(1.234) * Eigen::Translation3d(-5, 0, 0);
  EXPECT_TRUE(same_placing(part, all, Pose::Identity(), about, 0.01, 0.01 * kDegree));
  EXPECT_FALSE(same_placing(part, all, Pose::Identity(), turn_about_z(1.234), 0.5, 0.1 * kDegree));
}

TEST(DeclaredSymmetry, OfARoundPartNothingIsLeftToDeclare) {
  Part part = part_of({{Pose::Identity()}, {{Vec3::UnitZ(), Vec3::Zero()}}});
  part.nearly_round = {{-Vec3::UnitZ(), Vec3(0, 0, 7)}};  // the same line
  declare_free_spin(part);
  EXPECT_TRUE(part.declared.continuous.empty());
}

}  // namespace
}  // namespace tribin
