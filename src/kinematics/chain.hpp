#pragma once

// What forward and inverse kinematics share: angles of the bare chain, without the maker's zeros and signs.

#include <algorithm>
#include <cmath>

#include "tribin/kinematics/arm.hpp"

namespace tribin::robot {

inline Joints chain_from_shown(const Arm& arm, const Joints& shown) {
  Joints chain{};
  for (int i = 0; i < arm.axes(); ++i) chain[i] = arm.joints[i].sign * shown[i] - arm.joints[i].offset;
  return chain;
}

inline Joints shown_from_chain(const Arm& arm, const Joints& chain) {
  Joints shown{};
  for (int i = 0; i < arm.axes(); ++i) shown[i] = arm.joints[i].sign * (chain[i] + arm.joints[i].offset);
  return shown;
}

/// The smallest |sin| of wrist, elbow and shoulder. The shoulder of six axes is the wrist's distance from the first
/// axis, over the length of the arm.
inline double chain_singularity(const Arm& arm, const Joints& q) {
  if (arm.kind == ArmKind::srs_7)
    return std::min({std::abs(std::sin(q[1])), std::abs(std::sin(q[3])), std::abs(std::sin(q[5]))});
  const OrthoParallel& g = arm.six;
  const double k = std::hypot(g.a2, g.c3), bend = q[2] + std::atan2(g.a2, g.c3);
  const double x = g.a1 + g.c2 * std::sin(q[1]) + k * std::sin(q[1] + bend);
  return std::min({std::abs(std::sin(q[4])), std::abs(std::sin(bend)), std::hypot(x, g.b) / (g.c2 + k)});
}

}  // namespace tribin::robot
