#include <algorithm>
#include <cmath>

#include "bin_space.hpp"
#include "counted.hpp"
#include "judge.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::grasp {
namespace {

constexpr int kDirections = 16;
// Where a part is pushed: at half its height it slides, near its top it turns over.
constexpr double kHeights[] = {0.5, 0.85};
// The tool is turned about its own axis to find room for its body.
constexpr int kTurns = 4;

/// The closed tool, TCP frame.
std::vector<Convex> closed_tool(const GripperShape& gripper) { return pieces_at(gripper, gripper.stroke_min()); }

struct PartPushes {
  std::vector<Push> pushes;
  std::vector<RefusedGrasp> refused;
};

class Pusher {
 public:
  Pusher(const SceneFacts& facts, int part, const GripperShape& gripper, const DepthSpace* around, PartPushes& out)
      : facts_(facts),
        here_(facts.scene->parts[part]),
        lies_(facts.parts[part]),
        gripper_(gripper),
        tool_(closed_tool(gripper)),
        out_(out) {
    base_.part = part;
    base_.gripper = &gripper;
    base_.around = around;
  }

  void run() {
    for (int k = 0; k < kDirections; ++k) {
      const double angle = k * 2 * kPi / kDirections;
      const Vec3 direction(std::cos(angle), std::sin(angle), 0);
      for (const double height : kHeights) try_push(direction, height);
    }
  }

 private:
  double bottom() const { return *std::min_element(lies_.columns.low.begin(), lies_.columns.low.end()); }

  void refuse(const Refusal& refusal) {
    out_.refused.push_back(
        {base_.part, gripper_.gripper.name, "push", refusal.why, refusal.value, refusal.limit, refused_at_});
  }

  void try_push(const Vec3& direction, double height) {
    const double z = bottom() + height * (lies_.top - bottom());
    // Where a finger that comes along the direction meets the part.
    const Vec3 far = Vec3(lies_.center.x(), lies_.center.y(), z) - 2 * lies_.radius_mm * direction;
    const Pose part_from_base = here_.base_from_part.inverse();
    const auto hit =
        here_.part->tree->first_hit(part_from_base * far, part_from_base.linear() * direction, 4 * lies_.radius_mm);
    if (!hit) return;  // hollow at that height
    std::optional<Refusal> first;
    for (int k = 0; k < kTurns; ++k) {
      Attempt a = base_;
      const Vec3 closing = rotation_from_vector(Vec3(0, 0, k * kPi / kTurns)) * Vec3::UnitX();
      a.base_from_tcp.linear().col(0) = closing;
      a.base_from_tcp.linear().col(1) = Vec3(-Vec3::UnitZ()).cross(closing);
      a.base_from_tcp.linear().col(2) = -Vec3::UnitZ();
      const Vec3 ahead = a.base_from_tcp.linear().transpose() * direction;
      double reaches = 0;
      for (std::size_t i = 0; i < tool_.size(); ++i)
        if (gripper_.pieces[i].jaw) reaches = std::max(reaches, reach_along(tool_[i], ahead));
      const double sigma = sigma_along(*facts_.scene, here_, far + hit->t * direction, direction);
      const double gap = std::hypot(3 * sigma, facts_.options->clearance_mm);
      a.base_from_tcp.translation() = far + (hit->t - reaches - gap) * direction;
      a.room_mm = gap;
      refused_at_ = a.base_from_tcp;
      make_push_path(a, (gap + facts_.options->push_mm) * direction);
      const auto refusal = judge(a, direction);
      if (!refusal) {
        keep(a, direction, height);
        return;
      }
      if (!first) first = refusal;
    }
    refuse(*first);
  }

  void make_push_path(Attempt& a, const Vec3& push) const {
    Vec3 up(0, 0, facts_.options->approach_mm);
    if (facts_.scene->bin)
      up.z() = std::max(up.z(), way_over_rim(*facts_.scene->bin, swept(tool_, a.base_from_tcp, Vec3::Zero()),
                                             facts_.options->clearance_mm));
    const auto add = [&](Step step, const Vec3& move) {
      a.path.push_back({step, a.base_from_tcp, {}});
      a.path.back().base_from_tcp.translation() += move;
    };
    add(Step::pre_pick, up);
    add(Step::pick, Vec3::Zero());
    add(Step::push, push);
    add(Step::retreat, push + up);
    for (std::size_t i = 0; i + 1 < a.path.size(); ++i)
      a.moves.push_back(swept(tool_, a.path[i].base_from_tcp,
                              a.path[i + 1].base_from_tcp.translation() - a.path[i].base_from_tcp.translation()));
  }

  /// The part must have room: no wall in its way. What else lies there moves on.
  Checked check_room(const Vec3& direction) const {
    if (!facts_.scene->bin) return {};
    const CellBin& bin = *facts_.scene->bin;
    for (int axis = 0; axis < 2; ++axis)
      for (const int side : {-1, 1}) {
        const Vec3 out = side * bin.base_from_bin.linear().col(axis);
        const double moves = facts_.options->push_mm * direction.dot(out);
        const double room =
            out.dot(bin.base_from_bin.translation()) + 0.5 * bin.inner_size_mm[axis] + lowest_of(here_, -out);
        if (moves > 1e-9 && room < moves) return Refusal{Why::held_bin, room, moves};
      }
    return {};
  }

  Checked judge(Attempt& a, const Vec3& direction) const {
    a.clearance_mm = std::max(kFarGap_mm, facts_.options->clearance_mm);
    if (const auto refusal = check_workspace(facts_, a)) return refusal;
    if (const auto refusal = check_room(direction)) return refusal;
    if (const auto refusal = check_tool_walls(facts_, a)) return refusal;
    // On its way down the tool must touch nothing; then it touches what it pushes, and what lies behind that.
    Attempt down = a;
    down.moves.resize(1);
    if (const auto refusal = check_tool_scene(facts_, down)) return refusal;
    a.clearance_mm = down.clearance_mm;
    if (const auto refusal = check_reach(facts_, a, 1)) return refusal;
    return check_arm(facts_, a);
  }

  void keep(const Attempt& a, const Vec3& direction, double height) {
    Push push;
    push.part = a.part;
    push.id = here_.id;
    push.part_name = here_.part->part->name;
    push.gripper = gripper_.gripper.name;
    push.length_mm = facts_.options->push_mm;
    push.path = a.path;
    const auto term = [&push](const char* name, double value) {
      push.terms.push_back({name, std::clamp(value, 0.0, 1.0)});
    };
    term("confidence", here_.score);
    if (facts_.scene->bin) {
      const CellBin& bin = *facts_.scene->bin;
      const Vec3 to_middle = bin.base_from_bin.translation() - lies_.center;
      const Vec3 flat(to_middle.x(), to_middle.y(), 0);
      // A part in the middle is free of walls already: any direction is as good.
      term("to_middle", 0.5 + 0.5 * direction.dot(flat) / std::max(flat.norm(), 1.0));
    }
    term("height", 0.5 + 0.5 * lies_.height);
    // Sliding is surer than turning over.
    term("slides", 1.25 - 0.5 * height);
    term("clearance", 0.5 + 0.5 * a.clearance_mm / kFarGap_mm);
    if (a.arm_path) term("joints", 0.5 + 0.5 * a.arm_path->limit_term);
    push.score = 1;
    for (const Term& t : push.terms) push.score *= t.value;
    out_.pushes.push_back(std::move(push));
  }

  const SceneFacts& facts_;
  const PartHere& here_;
  const PartFacts& lies_;
  const GripperShape& gripper_;
  std::vector<Convex> tool_;
  PartPushes& out_;
  Attempt base_;
  Pose refused_at_ = Pose::Identity();
};

PartPushes push_part(const SceneFacts& facts, int part) {
  PartPushes out;
  const PartHere& here = facts.scene->parts[part];
  std::optional<DepthSpace> around;
  if (facts.depth) around = facts.depth->without(*here.part->tree, here.base_from_part);
  for (const GripperShape& gripper : here.part->grippers)
    if (may_use(*facts.options, gripper.gripper.name))
      Pusher(facts, part, gripper, around ? &*around : nullptr, out).run();
  return out;
}

}  // namespace

PushPlan plan_pushes(const Scene& scene, const PlanOptions& options) {
  const SceneFacts facts = make_facts(scene, options);
  std::vector<PartPushes> parts(scene.parts.size());
  parallel_each(static_cast<int>(parts.size()), [&](int i) { parts[i] = push_part(facts, i); });
  PushPlan plan;
  for (PartPushes& part : parts) {
    plan.pushes.insert(plan.pushes.end(), part.pushes.begin(), part.pushes.end());
    plan.refused.insert(plan.refused.end(), part.refused.begin(), part.refused.end());
  }
  std::stable_sort(plan.pushes.begin(), plan.pushes.end(),
                   [](const Push& a, const Push& b) { return a.score > b.score; });
  plan.reasons = counted(plan.refused);
  return plan;
}

}  // namespace tribin::grasp
