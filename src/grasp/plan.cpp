#include <algorithm>
#include <array>
#include <cmath>

#include "judge.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::grasp {
namespace {

constexpr std::array<std::string_view, kWhys> kWhyNames = {
    "confidence", "covered",   "hold",    "tried_before", "approach_angle", "stroke", "pose_sigma",
    "workspace",  "reach",     "form",    "bin",          "scan",           "part",   "obstacle",
    "held_bin",   "held_part", "arm_bin", "arm_scan",     "arm_obstacle",   "place"};

void validate(const PlanOptions& o) {
  const auto must = [](bool good, const char* name, double seen, const char* wanted) {
    if (!good)
      throw Error(ErrorCode::bad_option,
                  std::string(name) + ": saw " + std::to_string(seen) + ", wanted a number in " + wanted);
  };
  must(!o.max_tilt_rad || (*o.max_tilt_rad >= 0 && *o.max_tilt_rad <= kPi), "max_tilt_rad", o.max_tilt_rad.value_or(0),
       "[0, pi]");
  must(o.approach_mm > 0 && o.approach_mm <= 1000, "approach_mm", o.approach_mm, "(0, 1000]");
  must(o.retreat_mm > 0 && o.retreat_mm <= 1000, "retreat_mm", o.retreat_mm, "(0, 1000]");
  must(o.clearance_mm >= 0 && o.clearance_mm <= 100, "clearance_mm", o.clearance_mm, "[0, 100]");
  must(o.min_score >= 0 && o.min_score <= 1, "min_score", o.min_score, "[0, 1]");
  must(o.looks > 0, "looks", o.looks, "1 and more");
  must(o.most_per_part > 0, "most_per_part", o.most_per_part, "1 and more");
}

/// What became of one part's candidates.
struct PartPlan {
  std::vector<Grasp> grasps;
  std::vector<RefusedGrasp> refused;
  int not_looked_at = 0;
};

bool may_use(const PlanOptions& options, const std::string& gripper) {
  return options.grippers.empty() ||
         std::find(options.grippers.begin(), options.grippers.end(), gripper) != options.grippers.end();
}

RefusedGrasp refused_of(const SceneFacts& facts, const Attempt& attempt, const Refusal& refusal) {
  (void)facts;
  return {attempt.part,  attempt.gripper->gripper.name, attempt.candidate->family, refusal.why, refusal.value,
          refusal.limit, attempt.base_from_tcp};
}

void plan_gripper(const SceneFacts& facts, int part, int gripper, PartPlan& out) {
  const GraspPart& known = *facts.scene->parts[part].part;
  int looked = 0, found = 0;
  for (const Candidate& candidate : known.candidates) {
    if (candidate.gripper != gripper) continue;
    if (looked >= facts.options->looks || found >= facts.options->most_per_part) {
      ++out.not_looked_at;
      continue;
    }
    Attempt attempt;
    attempt.part = part;
    attempt.candidate = &candidate;
    attempt.gripper = &known.grippers[gripper];
    const auto refusal = judge(facts, attempt);
    if (refusal) {
      // What points the wrong way costs nothing, and does not count.
      looked += refusal->why > Why::workspace;
      out.refused.push_back(refused_of(facts, attempt, *refusal));
    } else {
      ++looked;
      ++found;
      out.grasps.push_back(scored(facts, attempt));
    }
  }
}

PartPlan plan_part(const SceneFacts& facts, int part) {
  PartPlan out;
  const PartHere& here = facts.scene->parts[part];
  if (!here.pick) return out;
  for (int g = 0; g < static_cast<int>(here.part->grippers.size()); ++g) {
    const std::string& name = here.part->grippers[g].gripper.name;
    if (!may_use(*facts.options, name)) continue;
    if (here.score < facts.options->min_score) {
      out.refused.push_back(
          {part, name, "", Why::confidence, here.score, facts.options->min_score, here.base_from_part});
      continue;
    }
    plan_gripper(facts, part, g, out);
  }
  return out;
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

}  // namespace

std::string_view name_of(Why why) { return kWhyNames[static_cast<int>(why)]; }

std::string_view name_of(Step step) {
  constexpr std::array<std::string_view, 4> kNames = {"entry", "pre_pick", "pick", "retreat"};
  return kNames[static_cast<int>(step)];
}

const PathPoint* Grasp::at(Step step) const {
  for (const PathPoint& point : path)
    if (point.step == step) return &point;
  return nullptr;
}

Plan plan_grasps(const Scene& scene, const PlanOptions& options) {
  validate(options);
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
  return plan;
}

}  // namespace tribin::grasp
