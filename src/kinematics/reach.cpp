#include <algorithm>
#include <cmath>

#include "chain.hpp"
#include "euler_zyz.hpp"
#include "seven_axes.hpp"
#include "tribin/core/error.hpp"
#include "tribin/kinematics/inverse.hpp"

namespace tribin::robot {
namespace {

// Beyond these a limit or a singularity is far: the terms of the score are 1.
constexpr double kFarLimit = 30 * kDegree;
constexpr double kFarSingularity = 0.5;  // |sin|: 30 deg
// A second of travel halves the score.
constexpr double kTravel_s = 1.0;
constexpr double kRounding = 1e-9;  // rad: on the limit is inside

Joints middle_of_ranges(const Arm& arm) {
  Joints middle{};
  for (int i = 0; i < arm.axes(); ++i) middle[i] = (arm.joints[i].min + arm.joints[i].max) / 2;
  return middle;
}

/// Keeps the best of the solutions that it is shown.
class BestReach {
 public:
  BestReach(const Arm& arm, const ReachOptions& options)
      : arm_(arm), options_(options), reference_(options.from ? *options.from : middle_of_ranges(arm)) {}

  /// \param singularity  as in Margins, where it is known already; < 0: not yet.
  void show(const Joints& joints, double arm_angle, double elbow_term, double singularity) {
    if (singularity >= 0 && singularity < options_.singularity_margin) return;
    // Limits first: they refuse most solutions, and a narrow one cannot beat the best so far.
    const double others = elbow_term * (singularity >= 0 ? singularity_term_of(singularity) : 1);
    const double wanted = best_ ? std::min(best_->score / others, 1.0) * kFarLimit : -kRounding;
    const double least = std::max(wanted, options_.limit_margin - kRounding);
    const std::optional<Joints> turned = turned_inside(joints, least);
    if (!turned) return;
    if (singularity < 0) singularity = chain_singularity(arm_, chain_from_shown(arm_, *turned));
    if (singularity < options_.singularity_margin) return;
    if (options_.form && (form_bits(arm_, *turned) ^ *options_.form) & 7) return;
    keep_if_better(*turned, arm_angle, elbow_term, singularity);
  }

  /// Whether joints that far from their limits may beat the best so far.
  bool may_help(double margin, double elbow_term, double singularity) const {
    if (more_turns_) return true;  // other turns may stand farther from the limits
    return margin >= (best_ ? best_->score / (elbow_term * singularity_term_of(singularity)) * kFarLimit : -kRounding);
  }

  const std::optional<Reach>& best() const { return best_; }

 private:
  static double singularity_term_of(double singularity) { return std::clamp(singularity / kFarSingularity, 0.01, 1.0); }

  std::optional<Joints> turned_inside(const Joints& joints, double least) const {
    bool inside = true, wide = false;
    for (int i = 0; i < arm_.axes() && inside; ++i) {
      const JointRange& range = arm_.joints[i];
      inside = joints[i] - range.min >= least && range.max - joints[i] >= least;
      wide = wide || range.max - range.min > 2 * kPi;
    }
    if (inside && !wide) return joints;
    // Other turns help only joints whose range leaves the half turns to both sides.
    if (!inside && !more_turns_) return std::nullopt;
    const std::optional<Joints> turned = nearest_turns(arm_, joints, reference_);
    for (int i = 0; turned && i < arm_.axes(); ++i)
      if ((*turned)[i] - arm_.joints[i].min < least || arm_.joints[i].max - (*turned)[i] < least) return std::nullopt;
    return turned;
  }

  void keep_if_better(const Joints& joints, double arm_angle, double elbow_term, double singularity) {
    Reach reach;
    reach.joints = joints;
    reach.arm_angle = arm_angle;
    reach.margins = {2 * kPi, singularity};
    double time = 0;
    for (int i = 0; i < arm_.axes(); ++i) {
      const JointRange& range = arm_.joints[i];
      reach.margins.limit = std::min({reach.margins.limit, joints[i] - range.min, range.max - joints[i]});
      if (options_.from) time = std::max(time, std::abs(joints[i] - reference_[i]) / range.max_speed);
    }
    // On a limit the arm stands well, if narrowly: the term is small there, but above 0.
    reach.limit_term = std::clamp(reach.margins.limit / kFarLimit, 0.01, 1.0);
    reach.singularity_term = singularity_term_of(singularity);
    reach.travel_term = 1 / (1 + time / kTravel_s);
    reach.elbow_term = elbow_term;
    reach.score = reach.limit_term * reach.singularity_term * reach.travel_term * reach.elbow_term;
    if (!best_ || reach.score > best_->score) best_ = reach;
  }

  bool any_joint_beyond_half_turns() const {
    return std::any_of(arm_.joints.begin(), arm_.joints.end(), [](const JointRange& range) {
      return range.min < -kPi - kRounding || range.max > kPi + kRounding || range.offset != 0;
    });
  }

  const Arm& arm_;
  const ReachOptions& options_;
  Joints reference_;
  bool more_turns_ = any_joint_beyond_half_turns();
  std::optional<Reach> best_;
};

/// How far each joint is from its limits in both values that it takes at one arm angle (see chains_at).
class SideMargins {
 public:
  SideMargins(const Arm& arm, const std::array<Joints, 8>& chains) {
    for (int i = 0; i < 7; ++i)
      for (const int side : {0, 1}) {
        const JointRange& range = arm.joints[i];
        shown_[i][side] = range.sign * (wrap(chains[kFirstWith[i][side]][i]) + range.offset);
        margin_[i][side] = std::min(shown_[i][side] - range.min, range.max - shown_[i][side]);
      }
  }

  double margin(int solution) const {
    double least = margin_[0][side(0, solution)];
    for (int i = 1; i < 7; ++i) least = std::min(least, margin_[i][side(i, solution)]);
    return least;
  }

  Joints joints(int solution) const {
    Joints joints;
    for (int i = 0; i < 7; ++i) joints[i] = shown_[i][side(i, solution)];
    return joints;
  }

 private:
  // Bits of a solution: 4 shoulder, 2 elbow, 1 wrist. Which of them turn a joint:
  static constexpr int kBits[7] = {4, 4, 6, 2, 3, 1, 1};
  static constexpr int kFirstWith[7][2] = {{0, 4}, {0, 4}, {0, 2}, {0, 2}, {0, 1}, {0, 1}, {0, 1}};
  static int side(int joint, int solution) { return __builtin_popcount(solution & kBits[joint]) & 1; }

  double shown_[7][2], margin_[7][2];
};

/// The larger of a joint's distances from its limits when it bends one way or the other: an upper bound.
double margin_of_bend(const JointRange& range, double bend) {
  const auto margin = [&range](double chain) {
    const double shown = range.sign * (wrap(chain) + range.offset);
    return std::min(shown - range.min, range.max - shown);
  };
  return std::max(margin(bend), margin(-bend));
}

void show_arm_angle(const Arm& arm, const SevenAxes& at, double angle, BestReach& best) {
  const ArmAngle turned = arm_angle_at(at, std::cos(angle), std::sin(angle));
  double elbow_term = 1;
  if (!arm.elbow_side.isZero()) elbow_term = 0.75 + 0.25 * turned.upper.col(2).dot(Eigen::Vector3d(arm.elbow_side));
  // Cheapest first: what bends shoulder and wrist tells how near limits and singularities are at best.
  const ZyzMiddle shoulder = zyz_middle_of(turned.upper), wrist = zyz_middle_of(turned.wrist);
  const double singularity = std::min({shoulder.sine, at.elbow_sine, wrist.sine});
  if (!best.may_help(margin_of_bend(arm.joints[1], shoulder.angle), elbow_term, singularity) ||
      !best.may_help(margin_of_bend(arm.joints[5], wrist.angle), elbow_term, singularity))
    return;
  const SideMargins sides(arm, chains_of(zyz_of(turned.upper, shoulder), at.elbow, zyz_of(turned.wrist, wrist)));
  for (int i = 0; i < 8; ++i)
    if (best.may_help(sides.margin(i), elbow_term, singularity))
      best.show(sides.joints(i), angle, elbow_term, singularity);
}

}  // namespace

std::optional<Reach> reach(const Arm& arm, const Pose& target, const ReachOptions& options) {
  BestReach best(arm, options);
  if (arm.kind == ArmKind::spherical_wrist_6) {
    for (const Joints& joints : inverse(arm, target)) best.show(joints, 0, 1, -1);
    return best.best();
  }
  const std::optional<SevenAxes> at = seven_axes_at(arm, target);
  if (!at) return std::nullopt;
  for (int i = 0; i < 24; ++i) show_arm_angle(arm, *at, wrap(i * 15 * kDegree), best);
  for (int i = 0; i < 72 && !best.best(); ++i)
    if (i % 3 != 0) show_arm_angle(arm, *at, wrap(i * 5 * kDegree), best);
  for (int i = 0; i < 360 && !best.best(); ++i) show_arm_angle(arm, *at, wrap(i * kDegree), best);
  return best.best();
}

std::optional<double> best_waist(const RobotModel& robot, const Arm& arm, std::span<const Pose> base_from_flange,
                                 const ReachOptions& options) {
  if (!robot.waist) throw Error(ErrorCode::bad_input, robot.name + " has no waist");
  constexpr double kStep = 5 * kDegree;
  const JointRange& range = robot.waist->range;
  std::optional<double> best;
  double best_score = 0;
  const int steps = static_cast<int>(std::floor((range.max - range.min) / kStep));
  for (int i = 0; i <= steps; ++i) {
    const double waist = range.min + i * kStep;
    const Pose arm_from_base = base_from_arm(robot, arm, waist).inverse();
    double worst = 1;
    for (const Pose& pose : base_from_flange) {
      const std::optional<Reach> found = reach(arm, arm_from_base * pose, options);
      worst = found ? std::min(worst, found->score) : 0;
      if (worst <= best_score) break;
    }
    if (worst > best_score) {
      best = waist;
      best_score = worst;
    }
  }
  return best;
}

}  // namespace tribin::robot
