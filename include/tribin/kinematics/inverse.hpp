#pragma once

#include <array>
#include <optional>
#include <span>

#include "tribin/kinematics/arm.hpp"

/// Inverse kinematics in closed form: every way to stand at a pose, and the best of them.
namespace tribin::robot {

struct JointSolutions {
  int count = 0;
  std::array<Joints, 8> all;
  const Joints* begin() const { return all.data(); }
  const Joints* end() const { return all.data() + count; }
};

/// All joint angles of a six-axis arm that reach the pose, limits aside; each angle in (-180, 180] deg of the chain.
/// Where the wrist is stretched its fourth axis is at 0.
/// \cost about 0.6 us
JointSolutions inverse(const Arm& arm, const Pose& arm_from_flange);

/// The same of a seven-axis arm with the elbow turned by the arm angle [rad] about the line shoulder to wrist.
/// \cost about 0.5 us
JointSolutions inverse(const Arm& arm, const Pose& arm_from_flange, double arm_angle);

/// Each joint by whole turns to where it is nearest to the reference inside its limits (cables: no needless turn).
/// \return none where a joint has no place inside its limits
std::optional<Joints> nearest_turns(const Arm& arm, const Joints& joints, const Joints& reference);

struct ReachOptions {
  std::optional<Joints>
      from;  ///< where the arm comes from: the near solution is the better one; none: the mid of the ranges
  std::optional<int> form;  ///< keep these form bits (the first three): pre-pick, pick and retreat in one configuration
  double limit_margin = 0;  ///< [rad] >= 0: stay that far from the limits
  double singularity_margin = 0;  ///< stay that far from singularities, see Margins (0.1 is usual)
};

/// An answer of `reach` with what made it the best.
struct Reach {
  Joints joints;
  Margins margins;
  double arm_angle = 0;                                                          ///< [rad] of seven axes
  double score = 0;                                                              ///< product of the four below
  double limit_term = 0, singularity_term = 0, travel_term = 0, elbow_term = 0;  ///< each in [0, 1]
};

/// The best way to stand at a pose inside limits and margins: a product of how far limits and singularities are, how
/// near it is to where the arm comes from, and on which side the elbow is. Seven axes: all arm angles in steps of 15
/// deg, in steps of 5 and 1 deg where these show nothing. \return none where there is no such way \cost   2 us (six
/// axes), below 10 us (seven)
std::optional<Reach> reach(const Arm& arm, const Pose& arm_from_flange, const ReachOptions& options = {});

/// The angle of the waist at which the worst of the poses is reached best, in steps of 5 deg over its range [rad]. A
/// robot keeps it for a bin: one owner, no coordination. \return none where no angle reaches all of them
std::optional<double> best_waist(const RobotModel& robot, const Arm& arm, std::span<const Pose> base_from_flange,
                                 const ReachOptions& options = {});

}  // namespace tribin::robot
