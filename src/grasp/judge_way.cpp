#include <algorithm>
#include <cmath>

#include "bin_space.hpp"
#include "judge.hpp"

// Path and reach, and what becomes of the part in hand.
namespace tribin::grasp {
namespace {

// A part that stands at a wall may seem to lie that deep in it.
constexpr double kAtWall_mm = 3;

PathPoint point_at(Step step, const Pose& pose, const Vec3& move = Vec3::Zero()) {
  PathPoint point{step, pose, {}};
  point.base_from_tcp.translation() += move;
  return point;
}

/// The part on its way up: no wall may come nearer than where it lies now.
Checked check_held(const SceneFacts& facts, const Attempt& a) {
  if (!facts.scene->bin) return {};
  const CellBin& bin = *facts.scene->bin;
  const PartHere& here = facts.scene->parts[a.part];
  const Vec3 way = a.path.back().base_from_tcp.translation() - a.base_from_tcp.translation();
  for (int axis = 0; axis < 2; ++axis)
    for (const int side : {-1, 1}) {
      const Vec3 out = side * bin.base_from_bin.linear().col(axis);
      const double wall = out.dot(bin.base_from_bin.translation()) + 0.5 * bin.inner_size_mm[axis];
      const double now = wall + lowest_of(here, -out), moves = out.dot(way);
      if (moves > 1e-9 && now - moves < -kAtWall_mm) return Refusal{Why::held_bin, now - moves, -kAtWall_mm};
    }
  return {};
}

/// Some place can be reached with the part in hand as this grasp holds it.
Checked check_place(const SceneFacts& facts, const Attempt& a) {
  const PartHere& here = facts.scene->parts[a.part];
  if (!facts.scene->arm || here.base_from_placed.empty()) return {};
  const ArmHere& arm = *facts.scene->arm;
  const Pose arm_from_base = base_from_arm(*arm.robot, *arm.arm, arm.waist).inverse();
  robot::ReachOptions wanted;
  wanted.from = a.path.back().joints;
  wanted.limit_margin = facts.options->limit_margin_rad;
  wanted.singularity_margin = facts.options->singularity;
  for (const Pose& placed : here.base_from_placed) {
    const Pose flange = placed * a.candidate->part_from_tcp * a.gripper->gripper.flange_from_tcp.inverse();
    Pose above = flange;
    above.translation().z() += facts.options->retreat_mm;
    if (reach(*arm.arm, arm_from_base * flange, wanted) && reach(*arm.arm, arm_from_base * above, wanted)) return {};
  }
  return Refusal{Why::place, 0, 1};
}

}  // namespace

double lowest_of(const PartHere& here, const Vec3& up) {
  const Vec3 in_part = here.base_from_part.linear().transpose() * up;
  double low = 1e300;
  for (const Vec3f& p : here.part->part->mesh.vertices) low = std::min(low, in_part.dot(p.cast<double>()));
  return low + up.dot(here.base_from_part.translation());
}

Checked check_workspace(const SceneFacts& facts, const Attempt& a) {
  if (!facts.scene->workspace) return {};
  for (const PathPoint& point : a.path) {
    const Vec3 p = point.base_from_tcp.translation();
    const CellRange& box = *facts.scene->workspace;
    const double out = std::max((box.min - p).maxCoeff(), (p - box.max).maxCoeff());
    if (out > 0) return Refusal{Why::workspace, out, 0};
  }
  return {};
}

Checked check_reach(const SceneFacts& facts, Attempt& a, std::size_t pick) {
  if (!facts.scene->arm) return {};
  std::vector<Pose> poses;
  for (const PathPoint& point : a.path) poses.push_back(point.base_from_tcp);
  ArmPathResult followed = follow(*facts.scene->arm, a.gripper->gripper.flange_from_tcp, poses, pick, *facts.options);
  if (!followed.path) return Refusal{followed.why, followed.value, followed.limit};
  a.arm_path = std::move(followed.path);
  for (std::size_t i = 0; i < a.path.size(); ++i) a.path[i].joints = a.arm_path->along[a.arm_path->at_points[i]];
  return {};
}

void make_path(const SceneFacts& facts, Attempt& a) {
  const std::vector<Convex> tool = pieces_at(*a.gripper, a.opening_before_mm);
  const Vec3 in = a.base_from_tcp.linear().col(2), up = Vec3::UnitZ();
  const double clear = facts.options->clearance_mm;
  Vec3 before = -facts.options->approach_mm * in, after = facts.options->retreat_mm * up;
  a.path.clear();
  if (facts.scene->bin) {
    const CellBin& bin = *facts.scene->bin;
    const Vec3 bin_up = bin.base_from_bin.linear().col(2);
    std::vector<Convex> held = swept(tool, a.base_from_tcp, Vec3::Zero());
    Convex lowest;  // of the part, as a point
    lowest.frame_from_body.translation() = lowest_of(facts.scene->parts[a.part], bin_up) * bin_up;
    held.push_back(lowest);
    after = std::max(facts.options->retreat_mm, way_over_rim(bin, held, clear)) * up;
    const double over = way_over_rim(bin, swept(tool, a.base_from_tcp, before), clear);
    // A tool that is all but upright goes straight on up; a tilted one would need the room of a wall.
    constexpr double kUpright = 2 * kDegree;
    if (over > 0 && a.tilt < kUpright)
      before -= over / std::cos(a.tilt) * in;
    else if (over > 0)
      a.path.push_back(point_at(Step::entry, a.base_from_tcp, before + over * up));
  }
  a.path.push_back(point_at(Step::pre_pick, a.base_from_tcp, before));
  a.path.push_back(point_at(Step::pick, a.base_from_tcp));
  a.path.push_back(point_at(Step::retreat, a.base_from_tcp, after));
  a.moves.clear();
  for (std::size_t i = 0; i + 1 < a.path.size(); ++i)
    a.moves.push_back(swept(tool, a.path[i].base_from_tcp,
                            a.path[i + 1].base_from_tcp.translation() - a.path[i].base_from_tcp.translation()));
}

Checked judge_walls(const SceneFacts& facts, Attempt& a) {
  a.clearance_mm = std::max(kFarGap_mm, facts.options->clearance_mm);
  make_path(facts, a);
  if (const auto refusal = check_workspace(facts, a)) return refusal;
  return check_tool_walls(facts, a);
}

Checked judge_way(const SceneFacts& facts, Attempt& a) {
  if (const auto refusal = check_reach(facts, a, a.path.size() - 2)) return refusal;
  if (const auto refusal = check_tool_scene(facts, a)) return refusal;
  if (const auto refusal = check_held(facts, a)) return refusal;
  if (const auto refusal = check_arm(facts, a)) return refusal;
  return check_place(facts, a);
}

}  // namespace tribin::grasp
