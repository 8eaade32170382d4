#include "judge.hpp"

#include <algorithm>
#include <cmath>

#include "bin_space.hpp"

namespace tribin::grasp {
namespace {

constexpr double kGravity = 9.81;  // m/s^2
// What a grip must hold at least: weight and an acceleration as large again.
constexpr double kHoldAtLeast = 1, kHoldWell = 2;
// A grasp is the one that failed where the tool stands within a part's usual scatter of it.
constexpr double kSame_mm = 5, kSame = 10 * kDegree;
// Gaps that large are as good as any.
constexpr double kFar_mm = 10;

using Check = std::optional<Refusal> (*)(const SceneFacts&, Attempt&);

const PartHere& part_of(const SceneFacts& facts, const Attempt& a) { return facts.scene->parts[a.part]; }

std::optional<Refusal> check_failed(const SceneFacts& facts, Attempt& a) {
  for (const FailedPick& failed : facts.options->failed) {
    const double away = (failed.base_from_tcp.translation() - a.base_from_tcp.translation()).norm();
    if (failed.gripper == a.gripper->gripper.name && away < kSame_mm &&
        rotation_angle(failed.base_from_tcp.linear(), a.base_from_tcp.linear()) < kSame)
      return Refusal{Why::tried_before, away, kSame_mm};
  }
  return {};
}

std::optional<Refusal> check_angle(const SceneFacts& facts, Attempt& a) {
  a.tilt = std::acos(std::clamp(-a.base_from_tcp.linear()(2, 2), -1.0, 1.0));
  a.max_tilt = part_of(facts, a).part->cell.max_tilt_rad;
  if (facts.options->max_tilt_rad) a.max_tilt = std::min(a.max_tilt, *facts.options->max_tilt_rad);
  if (a.tilt > a.max_tilt) return Refusal{Why::approach_angle, a.tilt, a.max_tilt};
  return {};
}

/// Jaws open by 3 sigma of the place and the clearance a side, as far as their stroke goes.
std::optional<Refusal> check_opening(const SceneFacts& facts, Attempt& a) {
  const Vec3 place = a.base_from_tcp.translation();
  a.sigma_mm = sigma_along(*facts.scene, part_of(facts, a), place, a.base_from_tcp.linear().col(0));
  if (a.gripper->jaws == 0) {
    a.room_mm = a.gripper->cup_mm;
    return {};
  }
  const double at = a.candidate->opening_mm, low = a.gripper->stroke_min(), high = a.gripper->stroke_max();
  if (at < low || at > high) return Refusal{Why::stroke, at, at < low ? low : high};
  const double wanted = 3 * a.sigma_mm + facts.options->clearance_mm;
  a.room_mm = std::min(wanted, (a.gripper->inside ? at - low : high - at) / 2);
  if (3 * a.sigma_mm > a.room_mm) return Refusal{Why::pose_sigma, 3 * a.sigma_mm, a.room_mm};
  a.opening_before_mm = a.gripper->inside ? at - 2 * a.room_mm : at + 2 * a.room_mm;
  return {};
}

std::optional<Refusal> check_hold(const SceneFacts& facts, Attempt& a) {
  const double weight = part_of(facts, a).part->cell.mass_kg * kGravity, force = a.gripper->gripper.force_n;
  if (weight == 0 || force == 0) return {};
  // Jaws hold by friction on each of them, cups and magnets directly.
  const double holds = a.gripper->jaws > 0 ? a.gripper->jaws * a.gripper->gripper.friction * force : force;
  a.hold = holds / weight;
  if (a.hold < kHoldAtLeast) return Refusal{Why::hold, a.hold, kHoldAtLeast};
  return {};
}

PathPoint point_at(Step step, const Pose& pose, const Vec3& move = Vec3::Zero()) {
  PathPoint point{step, pose, {}};
  point.base_from_tcp.translation() += move;
  return point;
}

/// Straight in along the tool and straight up. The way in begins above the bin: from pre-pick itself where the tool is
/// all but upright, else from a place above it.
void make_path(const SceneFacts& facts, Attempt& a) {
  const std::vector<Convex> tool = pieces_at(*a.gripper, a.opening_before_mm);
  const Vec3 in = a.base_from_tcp.linear().col(2), up = Vec3::UnitZ();
  const double clear = facts.options->clearance_mm;
  Vec3 before = -facts.options->approach_mm * in, after = facts.options->retreat_mm * up;
  a.path.clear();
  if (facts.scene->bin) {
    const CellBin& bin = *facts.scene->bin;
    after =
        std::max(facts.options->retreat_mm, way_over_rim(bin, swept(tool, a.base_from_tcp, Vec3::Zero()), clear)) * up;
    const double over = way_over_rim(bin, swept(tool, a.base_from_tcp, before), clear) * up.z();
    constexpr double kUpright = 2 * kDegree;
    if (over > 0 && a.tilt < kUpright)
      before -= over / std::cos(a.tilt) * in;
    else if (over > 0)
      a.path.push_back(point_at(Step::entry, a.base_from_tcp, before + over * up));
  }
  a.path.push_back(point_at(Step::pre_pick, a.base_from_tcp, before));
  a.path.push_back(point_at(Step::pick, a.base_from_tcp));
  a.path.push_back(point_at(Step::retreat, a.base_from_tcp, after));
}

std::optional<Refusal> check_workspace(const SceneFacts& facts, Attempt& a) {
  make_path(facts, a);
  if (!facts.scene->workspace) return {};
  for (const PathPoint& point : a.path) {
    const Vec3 p = point.base_from_tcp.translation();
    const double out =
        std::max((facts.scene->workspace->min - p).maxCoeff(), (p - facts.scene->workspace->max).maxCoeff());
    if (out > 0) return Refusal{Why::workspace, out, 0};
  }
  return {};
}

std::optional<Refusal> check_reach(const SceneFacts& facts, Attempt& a) {
  if (!facts.scene->arm) return {};
  std::vector<Pose> poses;
  for (const PathPoint& point : a.path) poses.push_back(point.base_from_tcp);
  ArmPathResult followed =
      follow(*facts.scene->arm, a.gripper->gripper.flange_from_tcp, poses, a.path.size() - 2, *facts.options);
  if (!followed.path) return Refusal{followed.why, followed.value, followed.limit};
  a.arm_path = std::move(followed.path);
  for (std::size_t i = 0; i < a.path.size(); ++i) a.path[i].joints = a.arm_path->along[a.arm_path->at_points[i]];
  return {};
}

/// The tool on each straight piece of its path: open on the way in, and as open on the way out (it holds less wide).
template <class Gap>
double least_gap_on_path(const Attempt& a, double enough, const Gap& gap) {
  const std::vector<Convex> tool = pieces_at(*a.gripper, a.opening_before_mm);
  double least = enough;
  for (std::size_t i = 0; i + 1 < a.path.size(); ++i) {
    const Vec3 move = a.path[i + 1].base_from_tcp.translation() - a.path[i].base_from_tcp.translation();
    least = std::min(least, gap(swept(tool, a.path[i].base_from_tcp, move), least));
  }
  return least;
}

std::optional<Refusal> check_bodies(Attempt& a, const std::vector<Convex>& bodies, Why why, double clearance) {
  const double gap = least_gap_on_path(a, std::max(a.clearance_mm, clearance), [&](const auto& tool, double enough) {
    return least_gap(tool, bodies, enough);
  });
  if (gap < clearance) return Refusal{why, gap, clearance};
  a.clearance_mm = std::min(a.clearance_mm, gap);
  return {};
}

std::optional<Refusal> check_bin(const SceneFacts& facts, Attempt& a) {
  return check_bodies(a, facts.bin, Why::bin, facts.options->clearance_mm);
}

std::optional<Refusal> check_obstacles(const SceneFacts& facts, Attempt& a) {
  return check_bodies(a, facts.scene->obstacles, Why::obstacle, facts.options->clearance_mm);
}

constexpr Check kChecks[] = {check_failed,    check_angle, check_hold, check_opening,
                             check_workspace, check_reach, check_bin,  check_obstacles};

}  // namespace

SceneFacts make_facts(const Scene& scene, const PlanOptions& options) {
  SceneFacts facts;
  facts.scene = &scene;
  facts.options = &options;
  if (scene.bin) facts.bin = bin_bodies(*scene.bin);
  return facts;
}

double sigma_along(const Scene& scene, const PartHere& part, const Vec3& base_point, const Vec3& direction) {
  // A point moves by dt + w x arm; along d that is d . dt + (arm x d) . w.
  const Vec3 arm = base_point - part.base_from_part.translation();
  Vector6 row;
  row << direction, arm.cross(direction);
  const double pose = row.dot(Vector6(part.covariance * row));
  const Vec3 from_camera = base_point - scene.base_from_camera.translation();
  const double turn = from_camera.cross(direction).norm() * scene.hand_eye_sigma_rad;
  const double place = scene.hand_eye_sigma_mm;
  return std::sqrt(std::max(pose, 0.0) + place * place + turn * turn);
}

std::optional<Refusal> judge(const SceneFacts& facts, Attempt& attempt) {
  attempt.base_from_tcp = part_of(facts, attempt).base_from_part * attempt.candidate->part_from_tcp;
  attempt.clearance_mm = std::max(kFar_mm, facts.options->clearance_mm);
  for (const Check check : kChecks)
    if (const auto refusal = check(facts, attempt)) return refusal;
  return {};
}

Grasp scored(const SceneFacts& facts, const Attempt& a) {
  const PartHere& here = part_of(facts, a);
  const Candidate& c = *a.candidate;
  Grasp grasp;
  grasp.part = a.part;
  grasp.id = here.id;
  grasp.part_name = here.part->part->name;
  grasp.gripper = a.gripper->gripper.name;
  grasp.family = c.family;
  grasp.part_from_tcp = c.part_from_tcp;
  grasp.opening_before_mm = a.opening_before_mm;
  grasp.opening_mm = c.opening_mm;
  grasp.clearance_mm = a.clearance_mm;
  grasp.sigma_mm = a.sigma_mm;
  grasp.path = a.path;
  const auto term = [&grasp](const char* name, double value) {
    grasp.terms.push_back({name, std::clamp(value, 0.0, 1.0)});
  };
  term("confidence", here.score);
  term("visible", 0.5 + 0.5 * here.visible);
  term("approach", 0.5 + 0.5 * (std::cos(a.tilt) - std::cos(a.max_tilt)) / (1 - std::cos(a.max_tilt) + 1e-9));
  term("contact", c.contact);
  term("offset", 1 / (1 + c.offset_mm / (0.25 * here.part->part->diameter_mm)));
  term("hold", a.hold / kHoldWell);
  term("room", a.gripper->jaws == 0 ? 1 : a.room_mm / (3 * a.sigma_mm + facts.options->clearance_mm));
  term("clearance", a.clearance_mm / kFar_mm);
  if (a.arm_path) {
    term("joints", a.arm_path->limit_term);
    term("singularity", a.arm_path->singularity_term);
  }
  double most = 0;
  for (const Candidate& other : here.part->candidates) most = std::max(most, other.priority);
  term("priority", c.priority / most);
  grasp.score = 1;
  for (const Term& t : grasp.terms) grasp.score *= t.value;
  return grasp;
}

}  // namespace tribin::grasp
