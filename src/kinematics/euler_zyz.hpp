#pragma once

// A rotation as Rz(first) Ry(middle) Rz(last): the wrist of a six-axis arm, shoulder and wrist of a seven-axis one.

#include <Eigen/Core>
#include <cmath>

#include "tribin/core/geometry.hpp"

namespace tribin::robot {

/// An angle in (-pi, pi]; for what lies within a few turns.
inline double wrap(double angle) {
  while (angle > kPi) angle -= 2 * kPi;
  while (angle <= -kPi) angle += 2 * kPi;
  return angle;
}

struct Zyz {
  double first, middle, last;  ///< middle in [0, pi]
};

/// The middle angle alone, with its sine.
struct ZyzMiddle {
  double sine, angle;
};
inline ZyzMiddle zyz_middle_of(const Eigen::Matrix3d& r) {
  const double sine = std::sqrt(r(0, 2) * r(0, 2) + r(1, 2) * r(1, 2));
  return {sine, std::atan2(sine, r(2, 2))};
}

/// The last angle comes from what the first one left over: near middle = 0 both are ill known, their sum is not. At it
/// the first is 0.
inline Zyz zyz_of(const Eigen::Matrix3d& r, const ZyzMiddle& middle) {
  constexpr double kLock = 1e-12;  // some thousand roundings: below it the first angle is noise
  if (middle.sine < kLock) return {0, middle.angle, std::atan2(r(1, 0), r(1, 1))};
  const double c = r(0, 2) / middle.sine, s = r(1, 2) / middle.sine;
  return {std::atan2(s, c), middle.angle, std::atan2(c * r(1, 0) - s * r(0, 0), c * r(1, 1) - s * r(0, 1))};
}
inline Zyz zyz_of(const Eigen::Matrix3d& r) { return zyz_of(r, zyz_middle_of(r)); }

}  // namespace tribin::robot
