#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "counted.hpp"
#include "judge.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::grasp {
namespace {

constexpr std::array<std::string_view, kWhys> kWhyNames = {
    "confidence", "covered",   "hold",    "tried_before", "approach_angle", "stroke", "pose_sigma",
    "workspace",  "reach",     "form",    "bin",          "scan",           "part",   "obstacle",
    "held_bin",   "held_part", "arm_bin", "arm_scan",     "arm_obstacle",   "place"};

/// What became of one part's candidates.
struct PartPlan {
  std::vector<Grasp> grasps;
  std::vector<RefusedGrasp> refused;
  int not_looked_at = 0;
};

/// The candidates of one part and gripper in a scene.
class GripperPlan {
 public:
  GripperPlan(const SceneFacts& facts, int part, int gripper, const DepthSpace* around, PartPlan& out)
      : facts_(facts),
        here_(facts.scene->parts[part]),
        part_(part),
        gripper_(here_.part->grippers[gripper]),
        around_(around),
        out_(out) {
    for (const Candidate& candidate : here_.part->candidates)
      if (candidate.gripper == gripper) candidates_.push_back(&candidate);
  }

  void run() {
    int looked = 0, found = 0;
    for (const Attempt& fits : in_order()) {
      if (looked >= facts_.options->looks || found >= facts_.options->most_per_part) {
        ++out_.not_looked_at;
        continue;
      }
      ++looked;
      found += look_closely(fits);
    }
  }

 private:
  void refuse(const Attempt& a, const Refusal& refusal) {
    out_.refused.push_back({part_, gripper_.gripper.name, a.candidate->family, refusal.why, refusal.value,
                            refusal.limit, a.base_from_tcp});
  }

  /// Those whose place is good, the most promising first. Neighbours fail for the same reason: the best of each surface
  /// and direction of approach come before any second best.
  std::vector<Attempt> in_order() {
    struct Ranked {
      Attempt attempt;
      double promise = 0;
      int round = 0;
    };
    std::vector<Ranked> ranked;
    for (const Candidate* candidate : candidates_) {
      Attempt a;
      a.part = part_;
      a.candidate = candidate;
      a.gripper = &gripper_;
      a.around = around_;
      a.base_from_tcp = here_.base_from_part * candidate->part_from_tcp;
      if (const auto refusal = judge_place(facts_, a)) {
        refuse(a, *refusal);
        continue;
      }
      // In the bin or out of the workspace: cheaper to see than reach, and what forbids most places at walls.
      if (const auto refusal = judge_walls(facts_, a)) {
        refuse(a, *refusal);
        continue;
      }
      const double offset = candidate->offset_mm / (0.25 * here_.part->part->diameter_mm);
      ranked.push_back({std::move(a), candidate->priority * candidate->contact / (1 + offset), 0});
      ranked.back().promise *= 0.5 + 0.5 * std::cos(ranked.back().attempt.tilt);
    }
    const auto better = [](const Ranked& a, const Ranked& b) { return a.promise > b.promise; };
    std::stable_sort(ranked.begin(), ranked.end(), better);
    std::map<std::string, int> rounds;
    for (Ranked& r : ranked) r.round = rounds[r.attempt.candidate->family + from_where(r.attempt)]++;
    std::stable_sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) { return a.round < b.round; });
    std::vector<Attempt> order;
    for (Ranked& r : ranked) order.push_back(std::move(r.attempt));
    return order;
  }

  /// From which side of the bin, and how steeply, a tool comes: upright, or one of eight sides by steps of 15 deg.
  std::string from_where(const Attempt& a) const {
    const int steep = static_cast<int>(a.tilt / (15 * kDegree) + 0.5);
    if (steep == 0) return " upright";
    Vec3 in = a.base_from_tcp.linear().col(2);
    if (facts_.scene->bin) in = facts_.scene->bin->base_from_bin.linear().transpose() * in;
    return " " + std::to_string(steep) + " " + std::to_string(std::lround(std::atan2(in.y(), in.x()) / (kPi / 4)) & 7);
  }

  /// As it is; where something lies beside the part, or its own shadow hides what does, with the jaws opened wider:
  /// they come down farther out, where it is lower, and close on the part.
  bool look_closely(const Attempt& fits) {
    constexpr double kWider_mm[] = {0, 5, 12};
    std::optional<Refusal> first;
    double room = -1;
    for (const double wider : kWider_mm) {
      Attempt a = fits;
      if (wider > 0) {
        if (gripper_.jaws == 0 || (first->why != Why::scan && first->why != Why::part)) break;
        a.wider_mm = wider;
        if (judge_place(facts_, a) || a.room_mm <= room || judge_walls(facts_, a)) break;
      }
      room = a.room_mm;
      const auto refusal = look_from_both_sides(a);
      if (!refusal) return true;
      if (!first) first = refusal;
    }
    refuse(fits, *first);
    return false;
  }

  /// As it is, and where the arm refuses, turned to the other side of equal jaws. \return why not
  Checked look_from_both_sides(const Attempt& fits) {
    const int turns = gripper_.jaws == 0 ? 1 : gripper_.jaws;
    std::optional<Refusal> first;
    for (int k = 0; k < turns; ++k) {
      Attempt a = fits;
      a.base_from_tcp.linear() =
          a.base_from_tcp.linear() * Matrix3(rotation_from_vector(Vec3(0, 0, k * 2 * kPi / turns)));
      // Equal jaws, but not always an equal body.
      auto refusal = k > 0 ? judge_walls(facts_, a) : std::nullopt;
      if (!refusal) refusal = judge_way(facts_, a);
      if (!refusal) {
        out_.grasps.push_back(scored(facts_, a));
        return {};
      }
      if (!first) first = refusal;
      const Why why = refusal->why;
      if (why != Why::reach && why != Why::form && why < Why::arm_bin) break;
    }
    return first;
  }

  const SceneFacts& facts_;
  const PartHere& here_;
  int part_;
  const GripperShape& gripper_;
  const DepthSpace* around_;
  PartPlan& out_;
  std::vector<const Candidate*> candidates_;
};

/// What is against all grasps of a part.
Checked judge_part(const SceneFacts& facts, int part) {
  const PartHere& here = facts.scene->parts[part];
  if (here.score < facts.options->min_score) return Refusal{Why::confidence, here.score, facts.options->min_score};
  const double covered = facts.parts[part].covered;
  if (covered > facts.options->max_covered) return Refusal{Why::covered, covered, facts.options->max_covered};
  return {};
}

PartPlan plan_part(const SceneFacts& facts, int part) {
  PartPlan out;
  const PartHere& here = facts.scene->parts[part];
  if (!here.pick) return out;
  const auto against = judge_part(facts, part);
  std::optional<DepthSpace> around;
  for (int g = 0; g < static_cast<int>(here.part->grippers.size()); ++g) {
    const std::string& name = here.part->grippers[g].gripper.name;
    if (!may_use(*facts.options, name)) continue;
    if (against) {
      out.refused.push_back({part, name, "", against->why, against->value, against->limit, here.base_from_part});
      continue;
    }
    if (facts.depth && !around) around = facts.depth->without(*here.part->tree, here.base_from_part);
    GripperPlan(facts, part, g, around ? &*around : nullptr, out).run();
  }
  return out;
}

}  // namespace

bool may_use(const PlanOptions& options, const std::string& gripper) {
  return options.grippers.empty() ||
         std::find(options.grippers.begin(), options.grippers.end(), gripper) != options.grippers.end();
}

std::vector<WhyCount> counted(const std::vector<RefusedGrasp>& refused) {
  std::array<int, kWhys> counts{};
  for (const RefusedGrasp& r : refused) ++counts[static_cast<int>(r.why)];
  std::vector<WhyCount> out;
  for (int i = 0; i < kWhys; ++i)
    if (counts[i] > 0) out.push_back({static_cast<Why>(i), counts[i]});
  std::stable_sort(out.begin(), out.end(), [](const WhyCount& a, const WhyCount& b) { return a.count > b.count; });
  return out;
}

std::string_view name_of(Why why) { return kWhyNames[static_cast<int>(why)]; }

std::string_view name_of(Step step) {
  constexpr std::array<std::string_view, 5> kNames = {"entry", "pre_pick", "pick", "push", "retreat"};
  return kNames[static_cast<int>(step)];
}

const PathPoint* Grasp::at(Step step) const {
  for (const PathPoint& point : path)
    if (point.step == step) return &point;
  return nullptr;
}

Plan plan_grasps(const Scene& scene, const PlanOptions& options) {
  const SceneFacts facts = make_facts(scene, options);
  std::vector<PartPlan> parts(scene.parts.size());
  parallel_each(static_cast<int>(parts.size()), [&](int i) { parts[i] = plan_part(facts, i); });
  Plan plan;
  for (PartPlan& part : parts) {
    plan.grasps.insert(plan.grasps.end(), part.grasps.begin(), part.grasps.end());
    plan.refused.insert(plan.refused.end(), part.refused.begin(), part.refused.end());
    plan.not_looked_at += part.not_looked_at;
  }
  std::stable_sort(plan.grasps.begin(), plan.grasps.end(),
                   [](const Grasp& a, const Grasp& b) { return a.score > b.score; });
  plan.reasons = counted(plan.refused);
  if (scene.arm && scene.arm->arm->capsules.empty())
    plan.warnings.push_back("arm " + scene.arm->arm->name +
                            ": its file has no capsules; its links are taken as a seventh of its length thick");
  return plan;
}

}  // namespace tribin::grasp
