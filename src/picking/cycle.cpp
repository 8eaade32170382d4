#include "tribin/picking/cycle.hpp"

#include <algorithm>
#include <chrono>

#include "picking/run.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

constexpr int kScansRemembered = 3;       // a grasp that failed is not tried again in so many
constexpr int kMostPushes = 5;            // in a row, without a pick
constexpr int kMostFailures = 10;         // grips in a row that held nothing: something else is wrong
constexpr int kMostTurns = 3;             // at the station, of one part
constexpr double kTurned = 45 * kDegree;  // a part that is put back as it stood gains nothing
constexpr int kPushClass = 255;           // B002 of a push, for jobs that close the jaws then
constexpr double kClosed_mm = 0.1;        // an opening that is said, and closed

constexpr double kSamePart_mm = 20;  // a part that was missed lies that near to where it was
constexpr Chooser::Where kAll[] = {Chooser::Where::slots, Chooser::Where::station, Chooser::Where::turned};

class Stopwatch {
 public:
  double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

std::string joined(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += (out.empty() ? "" : "; ") + text;
  return out;
}

std::string counted(const std::vector<grasp::WhyCount>& reasons) {
  std::string out;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, reasons.size()); ++i)
    out += (i ? ", " : "") + std::string(name_of(reasons[i].why)) + " " + std::to_string(reasons[i].count);
  return out.empty() ? "no grasp was found" : "refused: " + out;
}

}  // namespace

std::string_view name_of(Phase phase) {
  constexpr std::string_view kNames[] = {"recover", "scan", "choose", "pick", "place", "regrasp", "push", "end"};
  return kNames[static_cast<int>(phase)];
}

std::string_view name_of(Resort resort) {
  constexpr std::string_view kNames[] = {"none", "next_gripper", "full_tilt", "push"};
  return kNames[static_cast<int>(resort)];
}

Run::Run(const RunLinks& links, const RunOptions& options)
    : links_(links),
      options_(options),
      journal_(*links.journal),
      chooser_(*links.cell, *links.robot, *links.vision, links.limits) {
  if (now().filling.size() != chooser_.slots().size())
    throw Error(ErrorCode::bad_input, journal_.file().string() + ": saw a rack of " +
                                          std::to_string(now().filling.size()) + " slots, wanted one of " +
                                          std::to_string(chooser_.slots().size()));
}

RunEnd Run::go() {
  for (Phase phase = Phase::recover; phase != Phase::end;) {
    if (options_.entered) options_.entered(phase);
    switch (phase) {
      case Phase::recover:
        phase = recover();
        break;
      case Phase::scan:
        phase = scan();
        break;
      case Phase::choose:
        phase = choose();
        break;
      case Phase::pick:
        phase = pick();
        break;
      case Phase::place:
        phase = place();
        break;
      case Phase::regrasp:
        phase = regrasp();
        break;
      case Phase::push:
        phase = push();
        break;
      case Phase::end:
        break;
    }
  }
  return end_;
}

std::vector<Chooser::Where> Run::wheres() const {
  if (!chooser_.has_station() || now().at_station) return {Chooser::Where::slots};
  return {std::begin(kAll), std::end(kAll)};
}

std::vector<Chooser::Avoid> Run::to_avoid() const {
  std::vector<Chooser::Avoid> out;
  for (std::size_t i = 0; i < failed_.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (failed_[i].pick.gripper == failed_[k].pick.gripper &&
          (failed_[i].part_at - failed_[k].part_at).norm() < kSamePart_mm)
        out.push_back({failed_[i].part_at, failed_[i].pick.gripper});
  return out;
}

Phase Run::finish(const std::string& status, const std::string& message) {
  end_.status = status;
  end_.message = message + (station_trouble_.empty() ? "" : "; " + station_trouble_);
  return Phase::end;
}

void Run::tell(const std::string& state, const std::string& note) {
  report_.state = state;
  report_.scene = scene_;
  report_.note = note;
  report_.robot_s = links_.clock->now_s() - scan_s_;
  if (options_.told) options_.told(report_);
}

Phase Run::scan() {
  if (open_slots(chooser_.slots(), now().filling, links_.cell->rack->when_missing).empty())
    return finish("rack_full", "every slot of the rack holds a part");
  if (options_.most_parts > 0 && end_.placed >= options_.most_parts)
    return finish("most_parts", std::to_string(end_.placed) + " parts are placed, as many as were asked for");
  scene_ = std::max(scene_, now().last_scene) + 1;
  scan_s_ = links_.clock->now_s();
  sight_ = links_.vision->scan();
  report_ = {};
  report_.find_ms = sight_.find_ms;
  report_.seen = sight_.seen;
  std::erase_if(failed_, [&](const Failed& failed) { return scene_ - failed.scene > kScansRemembered; });
  if (!sight_.suspect.empty()) return finish("calibration_suspect", sight_.suspect);
  if (sight_.status == "empty") return finish("empty", "the bin is empty");
  if (sight_.status == "no_data") return finish("no_data", "the scan holds no measurement in the bin");
  return Phase::choose;
}

Phase Run::choose() {
  const Stopwatch watch;
  std::vector<grasp::FailedPick> failed;
  for (const Failed& f : failed_) failed.push_back(f.pick);
  const Places places = chooser_.places(now().filling);
  const grasp::Plan plan = links_.vision->plan(chooser_.plan_options(resort_, failed), places);
  std::vector<std::string> why;
  choice_ = chooser_.choose(plan, now().filling, here(), wheres(), to_avoid(), why);
  report_.plan_ms += watch.ms();
  report_.refused = plan.reasons;
  report_.resort = resort_;
  if (choice_) return Phase::pick;
  const bool wanted = std::any_of(sight_.seen.begin(), sight_.seen.end(),
                                  [&](const auto& seen) { return seen.second > 0 && places.count(seen.first) > 0; });
  const bool any =
      std::any_of(sight_.seen.begin(), sight_.seen.end(), [](const auto& seen) { return seen.second > 0; });
  if (any && !wanted && pushes_ == 0) {
    const Slot& next = *open_slots(chooser_.slots(), now().filling, links_.cell->rack->when_missing).front();
    tell("no_pick", "no part is seen that an open slot takes");
    return finish("part_missing", name_of(next) + " waits for a part that is not seen");
  }
  report_.note = why.empty() ? counted(plan.reasons) : joined(why);
  return next_resort();
}

Phase Run::next_resort() {
  if (resort_ == Resort::none && chooser_.has_more_grippers()) {
    resort_ = Resort::next_gripper;
    return Phase::choose;
  }
  if (resort_ < Resort::full_tilt) {
    resort_ = Resort::full_tilt;
    return Phase::choose;
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

Phase Run::pick() {
  const Choice choice = *choice_;
  const double age_s = links_.clock->now_s() - scan_s_;
  const std::vector<robot::Refusal> refusals = chooser_.refusals_of(choice, age_s);
  if (!refusals.empty()) {
    tell("no_pick", std::string(robot::name_of(refusals.front().code)) + ": " + refusals.front().message);
    if (++failures_ >= kMostFailures) return finish("not_pickable", report_.note);
    return Phase::scan;
  }
  const grasp::Grasp& grasp = choice.grasp;
  report_.part = grasp.part_name, report_.gripper = grasp.gripper, report_.grasp = grasp.family;
  report_.slot = choice.placing.slot ? choice.placing.slot->number : 0;
  report_.base_from_part = choice.part.base_from_part;
  report_.base_from_tcp = grasp.at(grasp::Step::pick)->base_from_tcp;
  report_.score = grasp.score, report_.terms = grasp.terms;
  turns_ = 0;
  const bool held = carry_out_pick(choice, scene_, false);
  if (held) {
    failures_ = pushes_ = 0;
    resort_ = Resort::none;
    return Phase::place;
  }
  failed_.push_back({{report_.base_from_tcp, grasp.gripper}, report_.base_from_part.translation(), scene_});
  tell("missed");
  if (++failures_ >= kMostFailures)
    return finish("not_pickable", std::to_string(failures_) + " grips in a row held nothing; look at the gripper");
  return Phase::scan;
}

Phase Run::place() {
  const Entry held = *now().in_hand;
  std::optional<Placing> placing;
  for (const Chooser::Where where : wheres())
    if (!placing) placing = chooser_.place(held, now().filling, here(), where);
  if (!placing) return in_doubt("the gripper holds " + held.part + ", and no open slot can be reached with it");
  travel(placing->stops[0].base_from_tcp, held.gripper);
  Entry entry = held;
  entry.event = Event::place_ordered;
  entry.slot = placing->slot ? placing->slot->number : 0;
  entry.base_from_part = placing->base_from_part;
  report_.part = held.part, report_.gripper = held.gripper, report_.grasp = held.grasp;
  report_.slot = entry.slot;
  const robot::CycleResult result =
      order(entry, robot::CycleCommand::place, {placing->stops.begin(), placing->stops.end()}, held.gripper,
            held.opening_mm, 0);
  if (result != robot::CycleResult::done) {
    tell("lost", "the part was not in the gripper any more when it came to its place");
    return Phase::scan;
  }
  if (!placing->slot) {
    tell("put_down");
    return Phase::regrasp;
  }
  ++end_.placed;
  tell("placed");
  return Phase::scan;
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
  for (const Chooser::Where where : kAll)
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
      choice.placing = *placing;
      if (carry_out_pick(choice, standing.scene, true)) {
        failures_ = 0;
        return Phase::place;
      }
      failed_.push_back(
          {{grasp.at(grasp::Step::pick)->base_from_tcp, grasp.gripper}, standing.base_from_part.translation(), scene_});
      tell("missed", "at the station");
      return ++failures_ >= kMostFailures ? give_up("is not gripped") : Phase::regrasp;
    }
  return give_up("no grasp leads from there to a slot (" + counted(plan.reasons) + ")");
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
    constexpr std::size_t kMostStops = 6;  // of one command
    if (!stops || stops->size() > kMostStops || !chooser_.way(here(), poses.front(), push.gripper)) continue;
    travel(poses.front(), push.gripper);
    Entry entry;
    entry.event = Event::move_ordered;
    entry.scene = scene_;
    entry.note = "push " + push.part_name;
    order(entry, robot::CycleCommand::way_points, *stops, push.gripper, kClosed_mm, kPushClass);
    report_.part = push.part_name, report_.gripper = push.gripper;
    tell("pushed", note);
    resort_ = Resort::none;
    return Phase::scan;
  }
  pushes_ = kMostPushes;
  report_.note = note.empty() ? counted(plan.reasons) : note;
  return next_resort();
}

RunEnd run_picking(const RunLinks& links, const RunOptions& options) { return Run(links, options).go(); }

CycleReport plan_first(const WorkCell& cell, const robot::RobotModel& robot, Vision& vision, const Filling& filling,
                       const robot::SafetyLimits& limits) {
  const Chooser chooser(cell, robot, vision, limits);
  CycleReport report;
  const Sight sight = vision.scan();
  report.state = "no_pick";
  report.seen = sight.seen;
  report.find_ms = sight.find_ms;
  report.note = sight.status;
  report.scene = 1;
  if (!sight.suspect.empty()) report.note = "calibration_suspect: " + sight.suspect;
  if (!sight.suspect.empty() || sight.status == "empty" || sight.status == "no_data") return report;
  for (const Resort resort : {Resort::none, Resort::next_gripper, Resort::full_tilt}) {
    const Stopwatch watch;
    const grasp::Plan plan = vision.plan(chooser.plan_options(resort, {}), chooser.places(filling));
    std::vector<std::string> why;
    const auto choice = chooser.choose(plan, filling, {}, kAll, {}, why);
    report.plan_ms += watch.ms();
    report.resort = resort;
    report.refused = plan.reasons;
    report.note = why.empty() ? counted(plan.reasons) : joined(why);
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
