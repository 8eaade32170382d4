#include "tribin/kinematics/inverse.hpp"

#include <gtest/gtest.h>

#include "support/arms.hpp"

namespace tribin {
namespace {

using robot::Arm;
using robot::ArmKind;
using robot::Joints;
using robot::JointSolutions;
using test::Random;

constexpr double kWanted = 1e-9;  // relative

JointSolutions solve(const Arm& arm, const Pose& target, double arm_angle) {
  return arm.kind == ArmKind::srs_7 ? inverse(arm, target, arm_angle) : inverse(arm, target);
}

/// How near the nearest solution is to the joints that made the pose; for seven axes over a fine scan of the arm angle.
double nearest(const Arm& arm, const JointSolutions& solutions, const Joints& truth) {
  double best = 10;
  for (const Joints& joints : solutions) best = std::min(best, test::difference(arm, joints, truth));
  return best;
}

TEST(Inverse, SixAxesFindTheTrueJointsOfRandomArmsAmongSolutionsThatAllReach) {
  for (unsigned seed = 1; seed <= 10000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Arm arm = test::random_arm(ArmKind::spherical_wrist_6, random);
    const Joints truth = test::random_joints(arm, random);
    const Pose target = arm_from_flange(arm, truth);
    const JointSolutions solutions = inverse(arm, target);
    ASSERT_GE(solutions.count, 4);
    ASSERT_EQ(solutions.count % 4, 0);
    for (const Joints& joints : solutions)
      ASSERT_LE(test::relative_error(arm, arm_from_flange(arm, joints), target), kWanted);
    // Near a singularity the angles themselves are ill known: those of the pose are not.
    if (margins(arm, truth).singularity > 1e-3) {
      ASSERT_LE(nearest(arm, solutions, truth), 1e-6);
    }
  }
}

TEST(Inverse, SevenAxesReachAtEveryArmAngle) {
  for (unsigned seed = 1; seed <= 10000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Arm arm = test::random_arm(ArmKind::srs_7, random);
    const Pose target = arm_from_flange(arm, test::random_joints(arm, random));
    const JointSolutions solutions = inverse(arm, target, test::between(random, -kPi, kPi));
    ASSERT_EQ(solutions.count, 8);
    for (const Joints& joints : solutions)
      ASSERT_LE(test::relative_error(arm, arm_from_flange(arm, joints), target), kWanted);
  }
}

TEST(Inverse, SevenAxesFindTheTrueJointsAtTheirArmAngle) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Arm arm = test::random_arm(ArmKind::srs_7, random);
    const Joints truth = test::random_joints(arm, random);
    if (margins(arm, truth).singularity < 0.05) continue;
    const Pose target = arm_from_flange(arm, truth);
    double angle = 0, best = 10;
    for (int i = 0; i < 360; ++i) {
      const double error = nearest(arm, inverse(arm, target, i * kDegree), truth);
      if (error < best) best = error, angle = i * kDegree;
    }
    for (double step = kDegree; step > 1e-12; step /= 2)
      for (const double try_at : {angle - step, angle + step}) {
        const double error = nearest(arm, inverse(arm, target, try_at), truth);
        if (error < best) best = error, angle = try_at;
      }
    EXPECT_LE(best, 1e-6);
  }
}

TEST(Inverse, StretchedAndLockedArmsKeepTheirDigits) {
  for (unsigned seed = 1; seed <= 3000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    for (const ArmKind kind : {ArmKind::spherical_wrist_6, ArmKind::srs_7}) {
      Arm arm = test::random_arm(kind, random);
      Joints joints = test::random_joints(arm, random);
      const double tiny = std::pow(10.0, test::between(random, -18, -3));
      // Each axis whose sine may vanish: elbow, wrist, shoulder.
      const int axis = kind == ArmKind::srs_7 ? std::array{1, 3, 5}[random() % 3] : std::array{2, 4}[random() % 2];
      double locked = tiny;
      if (axis == 2) locked -= std::atan2(arm.six.a2, arm.six.c3);
      joints[axis] = arm.joints[axis].sign * (locked + arm.joints[axis].offset);
      Pose target = arm_from_flange(arm, joints);
      if ((kind == ArmKind::srs_7 ? axis == 3 : axis == 2) && tiny < 1e-7) {
        // Rounding may put a stretched arm out of its reach: a hair nearer it must be.
        target.translation() -= 1e-9 * Vec3(target.translation().normalized());
      }
      const JointSolutions solutions = solve(arm, target, test::between(random, -kPi, kPi));
      for (const Joints& found : solutions)
        ASSERT_LE(test::relative_error(arm, arm_from_flange(arm, found), target), kWanted);
    }
  }
}

TEST(Inverse, OutOfReachGivesNone) {
  Pose far = Pose::Identity();
  far.translation() = Vec3(5000, 0, 0);
  EXPECT_EQ(inverse(test::gp110(), far).count, 0);
  EXPECT_EQ(inverse(test::sia20d(), far, 0).count, 0);
  EXPECT_FALSE(reach(test::gp110(), far));
  EXPECT_FALSE(reach(test::sia20d(), far));
}

TEST(Inverse, AlongTheFirstAxisOrAtItNothingBreaks) {
  for (const double height : {400.0, 700.0, 1200.0}) {
    Pose on_axis = Pose::Identity();
    on_axis.translation() = Vec3(0, 0, height);
    for (const Joints& joints : inverse(test::gp110(), on_axis))
      EXPECT_LE(test::relative_error(test::gp110(), arm_from_flange(test::gp110(), joints), on_axis), kWanted);
    for (const Joints& joints : inverse(test::sia20d(), on_axis, 0.3))
      EXPECT_LE(test::relative_error(test::sia20d(), arm_from_flange(test::sia20d(), joints), on_axis), kWanted);
  }
}

TEST(NearestTurns, TakesTheTurnNextToTheReferenceInsideTheLimits) {
  const Arm arm = test::gp110();  // R and T: +-360 deg
  Joints joints{0, 0, 0, 170 * kDegree, 0, -170 * kDegree};
  Joints reference{};
  reference[3] = -180 * kDegree;
  reference[5] = 185 * kDegree;
  const auto turned = nearest_turns(arm, joints, reference);
  ASSERT_TRUE(turned);
  EXPECT_NEAR((*turned)[3], -190 * kDegree, 1e-12);
  EXPECT_NEAR((*turned)[5], 190 * kDegree, 1e-12);
  reference[3] = 500 * kDegree;  // two turns away: the limit allows none of them
  const auto limited = nearest_turns(arm, joints, reference);
  ASSERT_TRUE(limited);
  EXPECT_NEAR((*limited)[3], 170 * kDegree, 1e-12);
  joints[4] = 130 * kDegree;  // B: +-125 deg
  EXPECT_FALSE(nearest_turns(arm, joints, reference));
}

TEST(NearestTurns, FindsATurnWheneverThereIsOne) {
  for (unsigned seed = 1; seed <= 5000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Arm arm = test::gp110();
    robot::JointRange& range = arm.joints[0];
    range.min = test::between(random, -8, 4);
    range.max = range.min + test::between(random, 0.5, 12);
    Joints joints{}, reference{};
    joints[0] = test::between(random, -kPi, kPi);
    reference[0] = test::between(random, range.min, range.max);
    double best = 100;
    for (int turn = -4; turn <= 4; ++turn) {
      const double q = joints[0] + turn * 2 * kPi;
      if (q >= range.min && q <= range.max) best = std::min(best, std::abs(q - reference[0]));
    }
    const auto turned = nearest_turns(arm, joints, reference);
    ASSERT_EQ(turned.has_value(), best < 100);
    // Ranges of less than a turn have one place only; wider ones the nearest.
    if (turned) {
      EXPECT_NEAR(std::abs((*turned)[0] - reference[0]), best, 1e-9);
    }
  }
}

TEST(Reach, FindsAWayInsideTheLimitsWhereverJointsInsideThemLed) {
  for (const Arm& arm : {test::gp110(), test::sia20d()})
    for (unsigned seed = 1; seed <= 2000; ++seed) {
      SCOPED_TRACE(arm.axes() * 100000 + static_cast<int>(seed));
      Random random(seed);
      const Joints truth = test::random_joints_in_limits(arm, random);
      const Pose target = arm_from_flange(arm, truth);
      robot::ReachOptions options;
      if (seed % 2) options.from = truth;
      const auto found = reach(arm, target, options);
      ASSERT_TRUE(found);
      EXPECT_LE(test::relative_error(arm, arm_from_flange(arm, found->joints), target), kWanted);
      EXPECT_GE(found->margins.limit, -1e-8);
      EXPECT_NEAR(margins(arm, found->joints).singularity, found->margins.singularity, 1e-9);
    }
}

TEST(Reach, KeepsMarginsAndForm) {
  const Arm arm = test::gp110();
  int kept = 0;
  for (unsigned seed = 1; seed <= 500; ++seed) {
    Random random(seed);
    const Joints truth = test::random_joints_in_limits(arm, random);
    const int form = form_bits(arm, truth);
    robot::ReachOptions options;
    options.form = form;
    options.limit_margin = 5 * kDegree;
    options.singularity_margin = 0.1;
    const auto found = reach(arm, arm_from_flange(arm, truth), options);
    if (!found) continue;
    ++kept;
    EXPECT_EQ(form_bits(arm, found->joints) & 7, form & 7);
    EXPECT_GE(found->margins.limit, 5 * kDegree - 1e-8);
    EXPECT_GE(found->margins.singularity, 0.1);
  }
  EXPECT_GT(kept, 100);
}

TEST(Reach, TurnsTheElbowToItsSide) {
  Arm arm = test::sia20d();
  double sum_left = 0, sum_right = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const Pose target = arm_from_flange(arm, test::random_joints_in_limits(arm, random));
    arm.elbow_side = Vec3(0, 1, 0);
    const auto left = reach(arm, target);
    arm.elbow_side = Vec3(0, -1, 0);
    const auto right = reach(arm, target);
    ASSERT_TRUE(left && right);
    sum_left += link_frames(arm, left->joints).arm_from_link[3].translation().y();
    sum_right += link_frames(arm, right->joints).arm_from_link[3].translation().y();
  }
  EXPECT_GT(sum_left, sum_right + 200 * 50);
}

}  // namespace
}  // namespace tribin
