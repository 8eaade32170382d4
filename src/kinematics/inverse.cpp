#include "tribin/kinematics/inverse.hpp"

#include <cmath>

#include "chain.hpp"
#include "euler_zyz.hpp"
#include "seven_axes.hpp"
#include "tribin/core/error.hpp"

namespace tribin::robot {
namespace {

void add(JointSolutions& solutions, const Arm& arm, const Joints& chain) {
  Joints wrapped{};
  for (int i = 0; i < arm.axes(); ++i) wrapped[i] = wrap(chain[i]);
  solutions.all[solutions.count++] = shown_from_chain(arm, wrapped);
}

}  // namespace

/// \source design page 4.1. The second angle of arm and wrist is taken from what the first one left over, not from an
/// arc
///         cosine of its own: so a stretched arm or wrist costs no digits.
JointSolutions inverse(const Arm& arm, const Pose& target) {
  TRIBIN_ASSERT(arm.kind == ArmKind::spherical_wrist_6);
  JointSolutions solutions;
  const OrthoParallel& g = arm.six;
  const Eigen::Matrix3d r = target.linear();
  const Eigen::Vector3d c = Eigen::Vector3d(target.translation()) - g.c4 * r.col(2);
  const double reach2 = c.x() * c.x() + c.y() * c.y() - g.b * g.b;
  if (!(reach2 >= 0)) return solutions;
  const double along = std::sqrt(reach2);  // of the wrist, from the first axis in the plane of the arm
  const double k2 = g.a2 * g.a2 + g.c3 * g.c3, k = std::sqrt(k2), psi = std::atan2(g.a2, g.c3);
  const double azimuth = std::atan2(c.y(), c.x()), aside = std::atan2(g.b, along);
  const double h = c.z() - g.c1;
  for (const bool back : {false, true}) {
    const double n = (back ? -along : along) - g.a1;
    const double v = (n * n + h * h - g.c2 * g.c2 - k2) / (2 * g.c2 * k);
    if (!(std::abs(v) <= 1)) continue;
    const double q1 = back ? azimuth + aside - kPi : azimuth - aside;
    const double c1 = std::cos(q1), s1 = std::sin(q1);
    const double bend = std::acos(v), sine = std::sqrt(1 - v * v), lean = std::atan2(n, h);
    const double rest = std::atan2(k * sine, g.c2 + k * v);
    for (const double elbow : {1.0, -1.0}) {
      const double q2 = lean - elbow * rest, q3 = elbow * bend - psi;
      const double c23 = std::cos(q2 + q3), s23 = std::sin(q2 + q3);
      Eigen::Matrix3d fore;  // Rz(q1) Ry(q2 + q3)
      fore << c1 * c23, -s1, c1 * s23, s1 * c23, c1, s1 * s23, -s23, 0, c23;
      const Zyz wrist = zyz_of(fore.transpose() * r);
      add(solutions, arm, {q1, q2, q3, wrist.first, wrist.middle, wrist.last});
      add(solutions, arm, {q1, q2, q3, wrist.first + kPi, -wrist.middle, wrist.last - kPi});
    }
  }
  return solutions;
}

JointSolutions inverse(const Arm& arm, const Pose& target, double arm_angle) {
  TRIBIN_ASSERT(arm.kind == ArmKind::srs_7);
  JointSolutions solutions;
  const std::optional<SevenAxes> solver = seven_axes_at(arm, target);
  if (!solver) return solutions;
  const ArmAngle angle = arm_angle_at(*solver, std::cos(arm_angle), std::sin(arm_angle));
  for (const Joints& chain : chains_of(zyz_of(angle.upper), solver->elbow, zyz_of(angle.wrist)))
    add(solutions, arm, chain);
  return solutions;
}

std::optional<Joints> nearest_turns(const Arm& arm, const Joints& joints, const Joints& reference) {
  constexpr double kTurn = 2 * kPi;
  constexpr double kRounding = 1e-9;  // rad: a joint that stands on its limit is inside
  Joints result{};
  for (int i = 0; i < arm.axes(); ++i) {
    const JointRange& range = arm.joints[i];
    double q = joints[i];
    if (q < range.min - kRounding || q > range.max + kRounding || range.max - range.min > kTurn) {
      q += kTurn * std::round((reference[i] - q) / kTurn);
      if (q < range.min - kRounding) q += kTurn * std::ceil((range.min - kRounding - q) / kTurn);
      if (q > range.max + kRounding) q -= kTurn * std::ceil((q - range.max - kRounding) / kTurn);
      if (q < range.min - kRounding) return std::nullopt;
    }
    result[i] = q;
  }
  return result;
}

}  // namespace tribin::robot
