#include "tribin/picking/cycle.hpp"

#include <algorithm>

#include "picking/run.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/stage_times.hpp"

namespace tribin::picking {
namespace {

constexpr int kScansRemembered = 3;  // a grasp that failed is not tried again in so many
constexpr double kSamePart_mm = 20;  // a part that was missed lies that near to where it was

}  // namespace

std::string_view name_of(Phase phase) {
  constexpr std::string_view kNames[] = {"recover", "scan",    "choose", "pick", "show",
                                         "place",   "regrasp", "push",   "end"};
  return kNames[static_cast<int>(phase)];
}

std::string_view name_of(Resort resort) {
  constexpr std::string_view kNames[] = {"none", "next_gripper", "full_tilt", "next_look", "push"};
  return kNames[static_cast<int>(resort)];
}

std::string text_of(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += (out.empty() ? "" : "; ") + text;
  return out;
}

std::string text_of(const std::vector<grasp::WhyCount>& reasons) {
  constexpr std::size_t kMost = 3;  // a sentence for people; the lines have them all
  std::string out;
  for (std::size_t i = 0; i < std::min(kMost, reasons.size()); ++i)
    out += (i ? ", " : "") + std::string(name_of(reasons[i].why)) + " " + std::to_string(reasons[i].count);
  return out.empty() ? "no grasp was found" : "refused: " + out;
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
      case Phase::show:
        phase = show();
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
  return {std::begin(kAllPlaces), std::end(kAllPlaces)};
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
  step_aside();
  const FlangePose flange = go_to_look();
  scan_s_ = links_.clock->now_s();
  sight_ = links_.vision->scan(flange);
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
  std::vector<grasp::FailedPick> failed;
  for (const Failed& f : failed_) failed.push_back(f.pick);
  const Places places = chooser_.places(now().filling);
  StageTimes times;
  auto watch = std::make_optional<StageTimer>(times, "plan");
  grasp::Plan plan = links_.vision->plan(chooser_.plan_options(resort_, failed), places);
  std::vector<std::string> why;
  constexpr Chooser::Where kDirect[] = {Chooser::Where::slots};
  choice_ = chooser_.choose(plan, now().filling, here(), kDirect, to_avoid(), why);
  if (!choice_ && wheres().size() > 1) {  // gripping anew takes longer than another look at the plan
    plan = links_.vision->plan(chooser_.plan_options(resort_, failed, true), places);
    why.clear();
    choice_ = chooser_.choose(plan, now().filling, here(), wheres(), to_avoid(), why);
  }
  watch.reset();
  report_.plan_ms += times.total();
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
  report_.note = why.empty() ? text_of(plan.reasons) : text_of(why);
  return next_resort();
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
    failures_ = pushes_ = look_ = 0;
    resort_ = Resort::none;
    return with_part();
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

RunEnd run_picking(const RunLinks& links, const RunOptions& options) {
  return links.cell->robots.size() > 1 ? pick_with_two_arms(links, options) : Run(links, options).go();
}

}  // namespace tribin::picking
