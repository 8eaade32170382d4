#pragma once

// The closed form of seven axes at one pose, prepared for many arm angles.

#include <array>
#include <optional>

#include "euler_zyz.hpp"
#include "tribin/kinematics/arm.hpp"

namespace tribin::robot {

/// Shoulder and wrist rotations as functions of the arm angle: fixed + cosine * cos + sine * sin.
struct SevenAxes {
  double elbow = 0;  ///< [rad] in [0, pi]
  double elbow_sine = 0;
  Eigen::Matrix3d upper_fixed, upper_cos, upper_sin;  ///< R03
  Eigen::Matrix3d wrist_fixed, wrist_cos, wrist_sin;  ///< R47
};

/// \return none where the pose is out of reach
std::optional<SevenAxes> seven_axes_at(const Arm& arm, const Pose& arm_from_flange);

/// Shoulder and wrist rotation at an arm angle.
struct ArmAngle {
  Eigen::Matrix3d upper, wrist;
};
inline ArmAngle arm_angle_at(const SevenAxes& at, double cosine, double sine) {
  return {at.upper_fixed + cosine * at.upper_cos + sine * at.upper_sin,
          at.wrist_fixed + cosine * at.wrist_cos + sine * at.wrist_sin};
}

/// The eight ways to bend shoulder, elbow and wrist at one arm angle, as angles of the chain. The elbow is in one place
/// in all. Bits of their number: 4 shoulder, 2 elbow, 1 wrist bent the other way.
std::array<Joints, 8> chains_of(const Zyz& shoulder, double elbow, const Zyz& wrist);

}  // namespace tribin::robot
