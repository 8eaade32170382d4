#include "arm_path.hpp"

#include <algorithm>
#include <cmath>

namespace tribin::grasp {
namespace {

using robot::Joints;

// Straight moves are followed in steps of 20 mm or 5 deg; a joint that turns by more than 40 deg in one of them turns
// over: no controller follows that at speed.
constexpr double kStep_mm = 20, kStep = 5 * kDegree, kTurnsOver = 40 * kDegree;

struct Follower {
  const robot::Arm& arm;
  Pose base_from_arm, tcp_from_flange;
  const PlanOptions& options;
  double arm_angle = 0;

  Pose arm_from_flange(const Pose& base_from_tcp) const {
    return base_from_arm.inverse() * base_from_tcp * tcp_from_flange;
  }

  /// The solution nearest to where the arm is. \return none where every one turns over or leaves the margins
  std::optional<Joints> next(const Joints& now, const Pose& base_from_tcp, double& least_turn) const {
    const Pose target = arm_from_flange(base_from_tcp);
    const robot::JointSolutions all =
        arm.kind == robot::ArmKind::srs_7 ? inverse(arm, target, arm_angle) : inverse(arm, target);
    std::optional<Joints> best;
    least_turn = 2 * kPi;
    for (const Joints& solution : all) {
      const auto turned = nearest_turns(arm, solution, now);
      if (!turned) continue;
      double turn = 0;
      for (int i = 0; i < arm.axes(); ++i) turn = std::max(turn, std::abs((*turned)[i] - now[i]));
      if (turn >= least_turn) continue;
      const robot::Margins m = margins(arm, *turned);
      if (m.limit < options.limit_margin_rad || m.singularity < options.singularity) continue;
      least_turn = turn;
      best = turned;
    }
    if (least_turn > kTurnsOver) best.reset();
    return best;
  }
};

Pose between(const Pose& a, const Pose& b, double t) {
  Pose pose = Pose::Identity();
  pose.translation() = (1 - t) * a.translation() + t * b.translation();
  const Vec3 turn = vector_from_rotation(b.linear() * a.linear().transpose());
  pose.linear() = rotation_from_vector(t * turn) * a.linear();
  return pose;
}

int steps_between(const Pose& a, const Pose& b) {
  const double way = (b.translation() - a.translation()).norm() / kStep_mm;
  return std::max(1, static_cast<int>(std::ceil(std::max(way, rotation_angle(a.linear(), b.linear()) / kStep))));
}

/// From one point of the path to the next ones, in either direction; appends what it passes.
bool walk(const Follower& follower, const std::vector<Pose>& path, std::size_t from, int direction,
          std::vector<std::vector<Joints>>& legs, const Joints& start, double& turn) {
  Joints now = start;
  for (std::size_t i = from; direction > 0 ? i + 1 < path.size() : i > 0; i += direction) {
    const Pose &a = path[i], &b = path[i + direction];
    std::vector<Joints> leg;
    for (int k = 1, n = steps_between(a, b); k <= n; ++k) {
      const auto next = follower.next(now, between(a, b, double(k) / n), turn);
      if (!next) return false;
      leg.push_back(now = *next);
    }
    legs.push_back(std::move(leg));
  }
  return true;
}

ArmPath joined(const std::vector<std::vector<Joints>>& back, const Joints& pick,
               const std::vector<std::vector<Joints>>& forth) {
  ArmPath path;
  for (auto leg = back.rbegin(); leg != back.rend(); ++leg) {
    path.at_points.push_back(path.along.size());
    path.along.insert(path.along.end(), leg->rbegin(), leg->rend());
  }
  path.at_points.push_back(path.along.size());
  path.along.push_back(pick);
  for (const auto& leg : forth) {
    path.along.insert(path.along.end(), leg.begin(), leg.end());
    path.at_points.push_back(path.along.size() - 1);
  }
  return path;
}

/// Controllers are told the form with each position, and refuse a straight move from one to another.
bool one_form(const robot::Arm& arm, const ArmPath& path) {
  const int form = form_bits(arm, path.along[path.at_points[0]]) & 7;
  return std::all_of(path.at_points.begin(), path.at_points.end(),
                     [&](std::size_t i) { return (form_bits(arm, path.along[i]) & 7) == form; });
}

}  // namespace

ArmPathResult follow(const ArmHere& here, const Pose& flange_from_tcp, const std::vector<Pose>& path, std::size_t pick,
                     const PlanOptions& options) {
  const robot::Arm& arm = *here.arm;
  Follower follower{arm, base_from_arm(*here.robot, arm, here.waist), flange_from_tcp.inverse(), options};
  robot::ReachOptions wanted;
  wanted.from = here.from;
  wanted.limit_margin = options.limit_margin_rad;
  wanted.singularity_margin = options.singularity;
  ArmPathResult result;
  const Pose at_pick = follower.arm_from_flange(path[pick]);
  // Ends out of reach are the rule, and cheaper to find than a path that leads there.
  for (std::size_t i : {pick, path.size() - 1, std::size_t{0}})
    if (!reach(arm, follower.arm_from_flange(path[i]), wanted)) return result;
  for (int form = -1; form < 8; ++form) {
    if (form >= 0) wanted.form = form;
    const auto best = reach(arm, at_pick, wanted);
    if (!best) continue;
    follower.arm_angle = best->arm_angle;
    std::vector<std::vector<Joints>> back, forth;
    double turn = 0;
    if (walk(follower, path, pick, -1, back, best->joints, turn) &&
        walk(follower, path, pick, 1, forth, best->joints, turn)) {
      ArmPath path = joined(back, best->joints, forth);
      if (!one_form(arm, path)) {
        result.why = Why::form;
        result.value = result.limit = 0;
        continue;
      }
      result.path = std::move(path);
      result.path->limit_term = best->limit_term;
      result.path->singularity_term = best->singularity_term;
      result.path->margins = best->margins;
      for (const Joints& joints : result.path->along) {
        const robot::Margins m = margins(arm, joints);
        result.path->margins.limit = std::min(result.path->margins.limit, m.limit);
        result.path->margins.singularity = std::min(result.path->margins.singularity, m.singularity);
      }
      return result;
    }
    result.why = Why::form;
    result.value = turn;
    result.limit = kTurnsOver;
  }
  return result;
}

}  // namespace tribin::grasp
