#include "tribin/kinematics/arm.hpp"

#include <algorithm>
#include <cmath>

#include "chain.hpp"
#include "tribin/core/error.hpp"

namespace tribin::robot {
namespace {

Eigen::Matrix3d turn(int axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  r(u, u) = r(v, v) = c;
  r(u, v) = -s;
  r(v, u) = s;
  return r;
}

/// The next frame: moved by an offset in the old one, then turned about one of its own axes.
Pose next(const Pose& from, const Eigen::Vector3d& offset, int axis, double angle) {
  Pose to = Pose::Identity();
  to.translation() = from * Vec3(offset);
  to.linear() = from.linear() * turn(axis, angle);
  return to;
}

struct Step {
  Eigen::Vector3d offset;
  int axis;
  double sign;
};

void walk(const Arm& arm, const Joints& joints, const std::array<Step, kMaxJoints>& steps, double tool,
          LinkFrames& frames) {
  const Joints q = chain_from_shown(arm, joints);
  frames.count = arm.axes() + 1;
  frames.arm_from_link[0] = Pose::Identity();
  for (int i = 0; i < arm.axes(); ++i) {
    const Step& step = steps[i];
    frames.arm_from_link[i + 1] = next(frames.arm_from_link[i], step.offset, step.axis, step.sign * q[i]);
  }
  Pose& flange = frames.arm_from_link[arm.axes()];
  flange.translation() += tool * flange.linear().col(2);
}

/// Whether R, modulo a turn, lies where the maker calls the wrist "no flip": (90, 270].
bool is_no_flip(double r) {
  double turns = r / (2 * kPi);
  turns -= std::floor(turns);
  return turns > 0.25 && turns <= 0.75;
}

}  // namespace

const Arm& arm_called(const RobotModel& robot, const std::string& name) {
  std::string known;
  for (const Arm& arm : robot.arms) {
    if (arm.name == name) return arm;
    known += (known.empty() ? "" : ", ") + arm.name;
  }
  throw Error(ErrorCode::bad_input, robot.name + ": saw the arm '" + name + "', wanted one of " + known);
}

Pose base_from_arm(const RobotModel& robot, const Arm& arm, double waist) {
  if (!robot.waist) return arm.mount_from_arm;
  const JointRange& range = robot.waist->range;
  return next(robot.waist->base_from_waist, Eigen::Vector3d::Zero(), 2, range.sign * waist - range.offset) *
         arm.mount_from_arm;
}

LinkFrames link_frames(const Arm& arm, const Joints& joints) {
  LinkFrames frames;
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  if (arm.kind == ArmKind::spherical_wrist_6) {
    const OrthoParallel& g = arm.six;
    walk(arm, joints,
         {Step{{0, 0, g.c1}, 2, 1}, Step{{g.a1, g.b, 0}, 1, 1}, Step{{0, 0, g.c2}, 1, 1}, Step{{g.a2, 0, g.c3}, 2, 1},
          Step{none, 1, 1}, Step{none, 2, 1}, Step{none, 2, 1}},
         g.c4, frames);
  } else {
    const ShoulderElbowWrist& g = arm.seven;
    walk(arm, joints,
         {Step{none, 2, 1}, Step{none, 1, 1}, Step{{0, 0, g.upper}, 2, 1}, Step{none, 1, -1},
          Step{{0, 0, g.fore}, 2, -1}, Step{none, 1, -1}, Step{none, 2, -1}},
         g.wrist, frames);
  }
  return frames;
}

Pose arm_from_flange(const Arm& arm, const Joints& joints) {
  return link_frames(arm, joints).arm_from_link[arm.axes()];
}

Margins margins(const Arm& arm, const Joints& joints) {
  Margins result{2 * kPi, 1};
  for (int i = 0; i < arm.axes(); ++i)
    result.limit = std::min({result.limit, joints[i] - arm.joints[i].min, arm.joints[i].max - joints[i]});
  result.singularity = chain_singularity(arm, chain_from_shown(arm, joints));
  return result;
}

double travel_time_s(const Arm& arm, const Joints& from, const Joints& to) {
  double time = 0;
  for (int i = 0; i < arm.axes(); ++i) time = std::max(time, std::abs(to[i] - from[i]) / arm.joints[i].max_speed);
  return time;
}

int form_bits(const Arm& arm, const Joints& joints) {
  const Joints q = chain_from_shown(arm, joints);
  const int axes = arm.axes();
  const double r = joints[axes - 3], t = joints[axes - 1], s = joints[0];
  bool lower, back;
  if (arm.kind == ArmKind::spherical_wrist_6) {
    const OrthoParallel& g = arm.six;
    const double bend = q[2] + std::atan2(g.a2, g.c3);
    lower = std::sin(bend) < 0;
    back = g.a1 + g.c2 * std::sin(q[1]) + std::hypot(g.a2, g.c3) * std::sin(q[1] + bend) < 0;
  } else {
    lower = q[3] > 0;
    back = q[1] < 0;
  }
  const auto beyond = [](double angle) { return std::abs(angle) >= kPi; };
  return (is_no_flip(r) ? 1 : 0) | (lower ? 2 : 0) | (back ? 4 : 0) | (beyond(r) ? 8 : 0) | (beyond(t) ? 16 : 0) |
         (beyond(s) ? 32 : 0);
}

// The elbow's turn E is third in a seven-axis chain and last in the controller's list.
Joints to_controller_order(const Arm& arm, const Joints& j) {
  if (arm.kind != ArmKind::srs_7) return j;
  return {j[0], j[1], j[3], j[4], j[5], j[6], j[2]};
}

Joints from_controller_order(const Arm& arm, const Joints& j) {
  if (arm.kind != ArmKind::srs_7) return j;
  return {j[0], j[1], j[6], j[2], j[3], j[4], j[5]};
}

namespace {

double pulses_per_rad(const Arm& arm, int joint) {
  const JointRange& range = arm.joints[joint];
  if (range.pulses_per_deg == 0)
    throw Error(ErrorCode::bad_input, "arm " + arm.name + ": pulses_per_deg of joint " + range.name + " is not given");
  return range.pulses_per_deg / kDegree;
}

}  // namespace

std::vector<long> pulses_from_joints(const Arm& arm, const Joints& joints) {
  Joints pulses{};
  for (int i = 0; i < arm.axes(); ++i) pulses[i] = joints[i] * pulses_per_rad(arm, i);
  pulses = to_controller_order(arm, pulses);
  std::vector<long> result;
  for (int i = 0; i < arm.axes(); ++i) result.push_back(std::lround(pulses[i]));
  return result;
}

Joints joints_from_pulses(const Arm& arm, const std::vector<long>& pulses) {
  if (static_cast<int>(pulses.size()) < arm.axes())
    throw Error(ErrorCode::bad_input, "arm " + arm.name + ": saw " + std::to_string(pulses.size()) +
                                          " pulses, wanted " + std::to_string(arm.axes()));
  Joints joints{};
  for (int i = 0; i < arm.axes(); ++i) joints[i] = static_cast<double>(pulses[i]);
  joints = from_controller_order(arm, joints);
  for (int i = 0; i < arm.axes(); ++i) joints[i] /= pulses_per_rad(arm, i);
  return joints;
}

}  // namespace tribin::robot
