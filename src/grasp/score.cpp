#include <algorithm>
#include <cmath>

#include "judge.hpp"

namespace tribin::grasp {
namespace {

// Twice the weight: what a path's accelerations ask for.
constexpr double kHoldWell = 2;
// Where a pick failed, its neighbours come later. The design's distance.
constexpr double kNearFailed_mm = 20, kNearFailed = 0.3;

double failed_near(const SceneFacts& facts, const Attempt& a) {
  for (const FailedPick& failed : facts.options->failed)
    if ((failed.base_from_tcp.translation() - a.base_from_tcp.translation()).norm() < kNearFailed_mm)
      return kNearFailed;
  return 1;
}

}  // namespace

Grasp scored(const SceneFacts& facts, const Attempt& a) {
  const PartHere& here = facts.scene->parts[a.part];
  const PartFacts& lies = facts.parts[a.part];
  const Candidate& c = *a.candidate;
  Grasp grasp;
  grasp.part = a.part;
  grasp.id = here.id;
  grasp.part_name = here.part->part->name;
  grasp.gripper = a.gripper->gripper.name;
  grasp.family = c.family;
  grasp.part_from_tcp = here.base_from_part.inverse() * a.base_from_tcp;
  grasp.opening_before_mm = a.opening_before_mm;
  grasp.opening_mm = c.opening_mm;
  grasp.clearance_mm = a.clearance_mm;
  grasp.sigma_mm = a.sigma_mm;
  grasp.path = a.path;
  const auto term = [&grasp](const char* name, double value) {
    grasp.terms.push_back({name, std::clamp(value, 0.0, 1.0)});
  };
  // Halves where the worst is still a grasp, and no reason to take a part that is wrong otherwise.
  term("confidence", here.score);
  term("visible", 0.5 + 0.5 * here.visible);
  term("height", 0.5 + 0.5 * lies.height);
  term("uncovered", 1 - lies.covered);
  term("entangled", 1 - lies.entangled);
  term("approach", 0.5 + 0.5 * (std::cos(a.tilt) - std::cos(a.max_tilt)) / (1 - std::cos(a.max_tilt) + 1e-9));
  term("contact", c.contact);
  term("offset", 1 / (1 + c.offset_mm / (0.25 * here.part->part->diameter_mm)));
  term("hold", a.hold / kHoldWell);
  term("room", a.gripper->jaws == 0 ? 1 : a.room_mm / std::hypot(3 * a.sigma_mm, facts.options->clearance_mm));
  term("clearance", 0.5 + 0.5 * (a.clearance_mm - facts.options->clearance_mm) /
                              (std::max(kFarGap_mm, facts.options->clearance_mm) - facts.options->clearance_mm + 1e-9));
  if (a.arm_path) {
    term("joints", 0.5 + 0.5 * a.arm_path->limit_term);
    term("singularity", 0.5 + 0.5 * a.arm_path->singularity_term);
  }
  term("not_failed", failed_near(facts, a));
  double most = 0;
  for (const Candidate& other : here.part->candidates) most = std::max(most, other.priority);
  term("priority", c.priority / most);
  grasp.score = 1;
  for (const Term& t : grasp.terms) grasp.score *= t.value;
  return grasp;
}

}  // namespace tribin::grasp
