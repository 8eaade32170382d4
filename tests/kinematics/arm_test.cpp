#include "tribin/kinematics/arm.hpp"

#include <gtest/gtest.h>

#include "support/arms.hpp"
#include "tribin/core/error.hpp"
#include "tribin/kinematics/inverse.hpp"

namespace tribin {
namespace {

using robot::Arm;
using robot::Joints;

Joints degrees(std::initializer_list<double> values) {
  Joints joints{};
  int i = 0;
  for (const double value : values) joints[i++] = value * kDegree;
  return joints;
}

TEST(ArmFromFlange, AtZeroAGp110PointsForward) {
  const Pose flange = arm_from_flange(test::gp110(), {});
  EXPECT_NEAR(flange.translation().x(), 320 + 1020 + 200, 1e-9);
  EXPECT_NEAR(flange.translation().y(), 0, 1e-9);
  EXPECT_NEAR(flange.translation().z(), 540 + 870 + 235, 1e-9);
  EXPECT_LE((flange.linear().col(2) - Vec3::UnitX()).norm(), 1e-12);
  EXPECT_LE((flange.linear().col(0) - Vec3::UnitZ()).norm(), 1e-12);
}

TEST(ArmFromFlange, AtZeroASevenAxisArmStandsStraight) {
  const Pose flange = arm_from_flange(test::sia20d(), {});
  EXPECT_LE((flange.translation() - Vec3(0, 0, 490 + 420 + 180)).norm(), 1e-9);
}

TEST(LinkFrames, AreRigidAndEndAtTheFlange) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    for (const robot::ArmKind kind : {robot::ArmKind::spherical_wrist_6, robot::ArmKind::srs_7}) {
      const Arm arm = test::random_arm(kind, random);
      const auto frames = link_frames(arm, test::random_joints(arm, random));
      ASSERT_EQ(frames.count, arm.axes() + 1);
      for (int i = 0; i < frames.count; ++i) {
        const Matrix3 r = frames.arm_from_link[i].linear();
        EXPECT_LE((r.transpose() * r - Matrix3::Identity()).cwiseAbs().maxCoeff(), 1e-12);
      }
      if (kind == robot::ArmKind::srs_7) {
        const Vec3 elbow = frames.arm_from_link[3].translation(), wrist = frames.arm_from_link[5].translation();
        EXPECT_NEAR(elbow.norm(), arm.seven.upper, 1e-9);
        EXPECT_NEAR((wrist - elbow).norm(), arm.seven.fore, 1e-9);
      }
    }
  }
}

TEST(FormBits, FollowTheMakersTable) {
  const Arm arm = test::gp110();
  // R in (90, 270] is no flip; 180 and more set their own bits.
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, 0, -30, 0})), 0);
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, 90, -30, 0})), 0);
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, 100, -30, 0})), 1);
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, -100, -30, 0})), 1);
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, 180, -30, 0})), 1 + 8);
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, 271, -30, 0})), 8);
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, -300, -30, 0})), 8);
  EXPECT_EQ(form_bits(arm, degrees({0, 0, 0, 0, -30, 200})), 16);
  EXPECT_EQ(form_bits(arm, degrees({-180, 0, 0, 0, -30, 0})), 32);
  EXPECT_EQ(form_bits(arm, degrees({0, -80, 80, 0, -30, 0})) & 4, 4);  // leaning behind its first axis
}

TEST(FormBits, TellTheEightWaysApart) {
  const Arm arm = test::gp110();
  for (unsigned seed = 1; seed <= 500; ++seed) {
    test::Random random(seed);
    const Joints truth = test::random_joints_in_limits(arm, random);
    if (margins(arm, truth).singularity < 0.05) continue;
    int seen = 0, count = 0;
    for (const Joints& joints : inverse(arm, arm_from_flange(arm, truth))) {
      seen |= 1 << (form_bits(arm, joints) & 7);
      ++count;
    }
    EXPECT_EQ(__builtin_popcount(seen), count) << seed;
  }
}

TEST(Controllers, HaveTheElbowTurnLast) {
  const Arm arm = test::sia20d();
  EXPECT_EQ(to_controller_order(arm, {1, 2, 3, 4, 5, 6, 7}), (Joints{1, 2, 4, 5, 6, 7, 3}));
  EXPECT_EQ(from_controller_order(arm, {1, 2, 4, 5, 6, 7, 3}), (Joints{1, 2, 3, 4, 5, 6, 7}));
  const Arm six = test::gp110();
  const Joints joints = degrees({10, -20, 30, -40, 50, -60});
  const auto pulses = pulses_from_joints(six, joints);
  EXPECT_EQ(pulses, (std::vector<long>{10000, -20000, 30000, -40000, 50000, -60000}));
  EXPECT_LE(test::difference(six, joints_from_pulses(six, pulses), joints), 1e-9);
  EXPECT_THROW(joints_from_pulses(six, {1, 2}), Error);
}

TEST(Waist, TurnsAllItsArms) {
  robot::RobotModel robot;
  robot.waist.emplace();
  robot.waist->base_from_waist.translation() = Vec3(0, 0, 900);
  robot.waist->range = test::joint("W", -170, 170, 125);
  robot.arms = {test::sia20d(), test::sia20d()};
  robot.arms[0].mount_from_arm.translation() = Vec3(150, 385, 450);
  const Pose turned = base_from_arm(robot, robot.arms[0], 90 * kDegree);
  EXPECT_LE((turned.translation() - Vec3(-385, 150, 1350)).norm(), 1e-9);

  // A pose behind the robot: only a turned waist brings it into reach.
  Pose behind = Pose::Identity();
  behind.linear() = rotation_from_vector(Vec3(kPi, 0, 0));
  behind.translation() = Vec3(-900, -300, 1000);
  EXPECT_FALSE(reach(robot.arms[0], base_from_arm(robot, robot.arms[0]).inverse() * behind));
  const auto waist = best_waist(robot, robot.arms[0], std::span(&behind, 1));
  ASSERT_TRUE(waist);
  EXPECT_TRUE(reach(robot.arms[0], base_from_arm(robot, robot.arms[0], *waist).inverse() * behind));
}

}  // namespace
}  // namespace tribin
