#include "picking/run.hpp"
#include "tribin/core/stage_times.hpp"

namespace tribin::picking {

CycleReport plan_first(const WorkCell& cell, const robot::RobotModel& robot, Vision& vision, const Filling& filling,
                       const robot::SafetyLimits& limits, const FlangePose& flange) {
  const Chooser chooser(cell, robot, vision, limits);
  CycleReport report;
  const Sight sight = vision.scan(flange);
  report.state = "no_pick";
  report.seen = sight.seen;
  report.find_ms = sight.find_ms;
  report.note = sight.status;
  report.scene = 1;
  if (!sight.suspect.empty()) report.note = "calibration_suspect: " + sight.suspect;
  if (!sight.suspect.empty() || sight.status == "empty" || sight.status == "no_data") return report;
  for (const Resort resort : {Resort::none, Resort::next_gripper, Resort::full_tilt}) {
    StageTimes times;
    auto watch = std::make_optional<StageTimer>(times, "plan");
    const grasp::Plan plan = vision.plan(chooser.plan_options(resort, {}), chooser.places(filling));
    std::vector<std::string> why;
    const auto choice = chooser.choose(plan, filling, {}, kAllPlaces, {}, why);
    watch.reset();
    report.plan_ms += times.total();
    report.resort = resort;
    report.refused = plan.reasons;
    report.note = why.empty() ? text_of(plan.reasons) : text_of(why);
    if (!choice) continue;
    report.state = "planned";
    report.note.clear();
    report.part = choice->grasp.part_name, report.gripper = choice->grasp.gripper, report.grasp = choice->grasp.family;
    report.slot = choice->placing.slot ? choice->placing.slot->number : 0;
    report.base_from_part = choice->part.base_from_part;
    report.base_from_tcp = choice->grasp.at(grasp::Step::pick)->base_from_tcp;
    report.score = choice->grasp.score, report.terms = choice->grasp.terms;
    break;
  }
  return report;
}

}  // namespace tribin::picking
