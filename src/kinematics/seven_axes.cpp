#include "seven_axes.hpp"

#include <cmath>

#include "euler_zyz.hpp"

namespace tribin::robot {

/// \source design page 4.2, with Rot(w, angle) = w w^T + (1 - w w^T) cos + [w]x sin, so that an arm angle costs
/// products only.
std::optional<SevenAxes> seven_axes_at(const Arm& arm, const Pose& target) {
  const ShoulderElbowWrist& g = arm.seven;
  const Eigen::Matrix3d r = target.linear();
  const Eigen::Vector3d to_wrist = Eigen::Vector3d(target.translation()) - g.wrist * r.col(2);
  const double distance = to_wrist.norm();
  const double v = (distance * distance - g.upper * g.upper - g.fore * g.fore) / (2 * g.upper * g.fore);
  if (!(std::abs(v) <= 1) || distance == 0) return std::nullopt;
  SevenAxes at;
  at.elbow = std::acos(v);
  const double sine = std::sqrt(1 - v * v);
  at.elbow_sine = sine;
  const double phi = std::atan2(g.fore * sine, g.upper + g.fore * v);  // of the upper arm from the line to the wrist
  const Eigen::Vector3d w = to_wrist / distance;
  const double across = std::hypot(w.x(), w.y());
  const double ca = across > 0 ? w.x() / across : 1, sa = across > 0 ? w.y() / across : 0;
  const double lean = std::atan2(across, w.z()) - phi;
  const double cl = std::cos(lean), sl = std::sin(lean);
  Eigen::Matrix3d upper;  // at arm angle 0: Rz(azimuth) Ry(lean)
  upper << ca * cl, -sa, ca * sl, sa * cl, ca, sa * sl, -sl, 0, cl;
  Eigen::Matrix3d cross;
  cross << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  at.upper_fixed = w * (w.transpose() * upper);
  at.upper_cos = upper - at.upper_fixed;
  at.upper_sin = cross * upper;
  Eigen::Matrix3d bend;  // Ry(elbow)^T
  bend << v, 0, -sine, 0, 1, 0, sine, 0, v;
  at.wrist_fixed = bend * (at.upper_fixed.transpose() * r);
  at.wrist_cos = bend * (at.upper_cos.transpose() * r);
  at.wrist_sin = bend * (at.upper_sin.transpose() * r);
  return at;
}

std::array<Joints, 8> chains_of(const Zyz& s, double bend, const Zyz& w) {
  std::array<Joints, 8> chains;
  int n = 0;
  // One arm in space, eight sets of angles: each of shoulder, elbow and wrist may bend the other way, with half a turn
  // about the axes beside it. Elbow, R, B and T turn against the chain's axes (z, y, z, -y, -z, -y, -z).
  for (const bool shoulder : {false, true})
    for (const bool elbow : {false, true})
      for (const bool wrist : {false, true})
        chains[n++] = {s.first + (shoulder ? kPi : 0.0),
                       shoulder ? -s.middle : s.middle,
                       s.last + (shoulder ? kPi : 0.0) + (elbow ? kPi : 0.0),
                       elbow ? bend : -bend,
                       -(w.first + (elbow ? kPi : 0.0) + (wrist ? kPi : 0.0)),
                       wrist ? w.middle : -w.middle,
                       -(w.last + (wrist ? kPi : 0.0))};
  return chains;
}

}  // namespace tribin::robot
