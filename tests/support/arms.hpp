#pragma once

// Arms for tests: the named ones of examples/robots in code, and arms of random lengths, zeros and signs.

#include <random>

#include "tribin/kinematics/arm.hpp"

namespace tribin::test {

using Random = std::mt19937_64;

inline double between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline robot::JointRange joint(const char* name, double min_deg, double max_deg, double speed_deg_s, double sign = 1,
                               double offset_deg = 0) {
  return {name, min_deg * kDegree, max_deg * kDegree, speed_deg_s * kDegree, sign, offset_deg * kDegree, 1000};
}

inline robot::Arm gp110() {
  robot::Arm arm;
  arm.name = "R1";
  arm.six = {320, -235, 0, 540, 870, 1020, 200};
  arm.joints = {joint("S", -180, 180, 140),     joint("L", -90, 155, 110),      joint("U", -80, 90, 130, -1, -90),
                joint("R", -360, 360, 175, -1), joint("B", -125, 125, 175, -1), joint("T", -360, 360, 255, -1, 180)};
  return arm;
}

inline robot::Arm sia20d() {
  robot::Arm arm;
  arm.name = "R1";
  arm.kind = robot::ArmKind::srs_7;
  arm.seven = {490, 420, 180};
  arm.joints = {joint("S", -180, 180, 130), joint("L", -110, 110, 130), joint("E", -170, 170, 170),
                joint("U", -130, 130, 170), joint("R", -180, 180, 200), joint("B", -110, 110, 200),
                joint("T", -180, 180, 400)};
  return arm;
}

inline robot::Arm random_arm(robot::ArmKind kind, Random& random) {
  robot::Arm arm = kind == robot::ArmKind::srs_7 ? sia20d() : gp110();
  if (kind == robot::ArmKind::srs_7)
    arm.seven = {between(random, 200, 600), between(random, 200, 600), between(random, 0, 300)};
  else
    arm.six = {between(random, -100, 400), between(random, -300, 300), between(random, -150, 150),
               between(random, 0, 600),    between(random, 300, 1200), between(random, 300, 1200),
               between(random, 0, 300)};
  for (robot::JointRange& range : arm.joints) {
    range.sign = random() % 2 ? 1 : -1;
    range.offset = (static_cast<double>(random() % 4) - 1) * kPi / 2;
  }
  return arm;
}

inline robot::Joints random_joints(const robot::Arm& arm, Random& random) {
  robot::Joints joints{};
  for (int i = 0; i < arm.axes(); ++i) joints[i] = between(random, -kPi, kPi);
  return joints;
}

inline robot::Joints random_joints_in_limits(const robot::Arm& arm, Random& random) {
  robot::Joints joints{};
  for (int i = 0; i < arm.axes(); ++i) joints[i] = between(random, arm.joints[i].min, arm.joints[i].max);
  return joints;
}

/// The larger of the place's error over the arm's length and the matrix' error.
inline double relative_error(const robot::Arm& arm, const Pose& a, const Pose& b) {
  const double length = arm.kind == robot::ArmKind::srs_7 ? arm.seven.upper + arm.seven.fore + arm.seven.wrist
                                                          : arm.six.c2 + arm.six.c3 + arm.six.c4;
  return std::max((a.translation() - b.translation()).norm() / length, (a.linear() - b.linear()).cwiseAbs().maxCoeff());
}

/// The largest difference of two sets of angles, modulo whole turns [rad].
inline double difference(const robot::Arm& arm, const robot::Joints& a, const robot::Joints& b) {
  double worst = 0;
  for (int i = 0; i < arm.axes(); ++i) worst = std::max(worst, std::abs(std::remainder(a[i] - b[i], 2 * kPi)));
  return worst;
}

}  // namespace tribin::test
