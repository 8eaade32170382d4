#include <algorithm>
#include <cmath>

#include "judge.hpp"

// The checks that a candidate's place alone decides.
namespace tribin::grasp {
namespace {

constexpr double kGravity = 9.81;  // m/s^2
// A grip holds the weight at least; by a path's accelerations it is scored.
constexpr double kHoldAtLeast = 1;
// A grasp is the one that failed where the tool stands within a part's usual scatter of it.
constexpr double kSame_mm = 5, kSame = 10 * kDegree;

Checked check_failed(const SceneFacts& facts, const Attempt& a) {
  for (const FailedPick& failed : facts.options->failed) {
    const double away = (failed.base_from_tcp.translation() - a.base_from_tcp.translation()).norm();
    if (failed.gripper == a.gripper->gripper.name && away < kSame_mm &&
        rotation_angle(failed.base_from_tcp.linear(), a.base_from_tcp.linear()) < kSame)
      return Refusal{Why::tried_before, away, kSame_mm};
  }
  return {};
}

Checked check_angle(const SceneFacts& facts, Attempt& a) {
  a.tilt = std::acos(std::clamp(-a.base_from_tcp.linear()(2, 2), -1.0, 1.0));
  a.max_tilt = facts.scene->parts[a.part].part->cell.max_tilt_rad;
  if (facts.options->max_tilt_rad) a.max_tilt = std::min(a.max_tilt, *facts.options->max_tilt_rad);
  if (a.tilt > a.max_tilt) return Refusal{Why::approach_angle, a.tilt, a.max_tilt};
  return {};
}

Checked check_hold(const SceneFacts& facts, Attempt& a) {
  const double weight = facts.scene->parts[a.part].part->cell.mass_kg * kGravity;
  const Gripper& gripper = a.gripper->gripper;
  if (weight == 0 || gripper.force_n == 0) return {};
  // Jaws hold by friction on each of them, cups and magnets directly.
  const double holds = a.gripper->jaws > 0 ? a.gripper->jaws * gripper.friction * gripper.force_n : gripper.force_n;
  a.hold = holds / weight;
  if (a.hold < kHoldAtLeast) return Refusal{Why::hold, a.hold, kHoldAtLeast};
  return {};
}

/// Jaws open by 3 sigma of the place and the clearance a side, and by what is asked beyond, as far as their stroke
/// goes.
Checked check_opening(const SceneFacts& facts, Attempt& a) {
  const PartHere& here = facts.scene->parts[a.part];
  const Matrix3& r = a.base_from_tcp.linear();
  const Vec3 place = a.base_from_tcp.translation();
  a.sigma_mm = sigma_along(*facts.scene, here, place, r.col(0));
  // What closes or sits on all sides is asked in its worst direction.
  if (a.gripper->jaws != 2) a.sigma_mm = std::max(a.sigma_mm, sigma_along(*facts.scene, here, place, r.col(1)));
  if (a.gripper->jaws == 0) {
    a.room_mm = a.gripper->cup_mm;
  } else {
    const double at = a.candidate->opening_mm, low = a.gripper->stroke_min(), high = a.gripper->stroke_max();
    if (at < low || at > high) return Refusal{Why::stroke, at, at < low ? low : high};
    const double wanted = std::hypot(3 * a.sigma_mm, facts.options->clearance_mm) + a.wider_mm;
    a.room_mm = std::min(wanted, (a.gripper->inside ? at - low : high - at) / 2);
    a.opening_before_mm = a.gripper->inside ? at - 2 * a.room_mm : at + 2 * a.room_mm;
  }
  if (3 * a.sigma_mm > a.room_mm) return Refusal{Why::pose_sigma, 3 * a.sigma_mm, a.room_mm};
  return {};
}

}  // namespace

Checked judge_place(const SceneFacts& facts, Attempt& a) {
  if (const auto refusal = check_hold(facts, a)) return refusal;
  if (const auto refusal = check_failed(facts, a)) return refusal;
  if (const auto refusal = check_angle(facts, a)) return refusal;
  return check_opening(facts, a);
}

}  // namespace tribin::grasp
