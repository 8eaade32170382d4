// What is tried when no grasp is left, and what goes on at the station.
#include <algorithm>

#include "picking/run.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

constexpr int kMostPushes = 5;            // in a row, without a pick
constexpr int kMostTurns = 3;             // at the station, of one part
constexpr double kTurned = 45 * kDegree;  // a part that is put back as it stood gains nothing
constexpr int kPushClass = 255;           // B002 of a push, for jobs that close the jaws then
constexpr double kClosed_mm = 0.1;        // an opening that is said, and closed

}  // namespace

Phase Run::next_resort() {
  if (resort_ == Resort::none && chooser_.has_more_grippers()) {
    resort_ = Resort::next_gripper;
    return Phase::choose;
  }
  if (resort_ < Resort::full_tilt) {
    resort_ = Resort::full_tilt;
    return Phase::choose;
  }
  if (links_.cell->mount() == CameraMount::hand && look_ + 1 < static_cast<int>(links_.cell->camera->looks.size())) {
    ++look_;
    tell("no_pick", "the next scan is taken from look " + std::to_string(look_ + 1));
    resort_ = Resort::next_look;
    return Phase::scan;
  }
  if (pushes_ < kMostPushes) {
    resort_ = Resort::push;
    return Phase::push;
  }
  const std::string note = report_.note;
  tell("no_pick", note);
  if (std::all_of(sight_.seen.begin(), sight_.seen.end(), [](const auto& seen) { return seen.second == 0; }))
    return finish("not_empty_no_object", "something lies in the bin, and no part is found in it");
  return finish("not_pickable", "no part can be picked: " + note);
}

Phase Run::regrasp() {
  const Entry standing = *now().at_station;
  grasp::PlanOptions options = chooser_.plan_options(Resort::full_tilt, {});
  for (const Failed& f : failed_) options.failed.push_back(f.pick);
  Places places = chooser_.places(now().filling);
  const grasp::Plan plan = links_.vision->plan_standing(standing.part, standing.base_from_part, options, places);
  const auto give_up = [&](const std::string& why) {  // the others go on without a station
    station_trouble_ = standing.part + " stands at the station and " + why + ": take it away, then say --slot-is empty";
    failures_ = 0;
    tell("no_pick", station_trouble_);
    return Phase::scan;
  };
  // To a slot; or, where it stands turned over, to where it stands as in a slot.
  for (const Chooser::Where where : kAllPlaces)
    for (const grasp::Grasp& grasp : plan.grasps) {
      Entry held = standing;
      held.gripper = grasp.gripper, held.opening_mm = grasp.opening_before_mm;
      held.tcp_from_part = grasp.part_from_tcp.inverse();
      const Pose flange =
          grasp.path.back().base_from_tcp * chooser_.shape(grasp.gripper).gripper.flange_from_tcp.inverse();
      if (!chooser_.way(here(), grasp.path.front().base_from_tcp, grasp.gripper)) continue;
      const auto placing = chooser_.place(held, now().filling, {flange, grasp.path.back().joints}, where);
      if (!placing) continue;
      if (where != Chooser::Where::slots) {
        const Pose turn = placing->base_from_part.inverse() * standing.base_from_part;
        if (rotation_angle(turn.linear(), Matrix3::Identity()) < kTurned || ++turns_ > kMostTurns) continue;
      }
      Choice choice;
      choice.grasp = grasp;
      choice.part.base_from_part = standing.base_from_part;
      choice.part.covariance = covariance_of_standing(*links_.cell);
      choice.placing = *placing;
      if (carry_out_pick(choice, standing.scene, true)) {
        failures_ = 0;
        return with_part();
      }
      failed_.push_back(
          {{grasp.at(grasp::Step::pick)->base_from_tcp, grasp.gripper}, standing.base_from_part.translation(), scene_});
      tell("missed", "at the station");
      // Nothing moved it there: it does not stand as it was thought to, and jaws would only push it.
      return give_up("is not gripped, so that it does not stand there as it should");
    }
  return give_up("no grasp leads from there to a slot (" + text_of(plan.reasons) + ")");
}

Phase Run::push() {
  const std::string note = report_.note;
  const grasp::PushPlan plan = links_.vision->plan_pushes(chooser_.plan_options(Resort::push, {}));
  ++pushes_;
  for (const grasp::Push& push : plan.pushes) {
    const ArmWithTool arm = chooser_.arm_with(push.gripper);
    std::vector<Pose> poses;
    for (const grasp::PathPoint& point : push.path) poses.push_back(point.base_from_tcp);
    const auto stops = stops_at(arm, poses);
    if (!stops || stops->size() > kMostStops || !chooser_.way(here(), poses.front(), push.gripper)) continue;
    travel(poses.front(), push.gripper);
    Entry entry;
    entry.event = Event::move_ordered;
    entry.scene = scene_;
    entry.note = "push " + push.part_name;
    order(entry, robot::CycleCommand::way_points, *stops, push.gripper, kClosed_mm, kPushClass);
    report_.part = push.part_name, report_.gripper = push.gripper;
    tell("pushed", note);
    resort_ = Resort::none, look_ = 0;
    return Phase::scan;
  }
  pushes_ = kMostPushes;
  report_.note = note.empty() ? text_of(plan.reasons) : note;
  return next_resort();
}

}  // namespace tribin::picking
