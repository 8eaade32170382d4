#include "picking/two_arms.hpp"

#include <algorithm>

#include "tribin/core/error.hpp"
#include "tribin/core/stage_times.hpp"

namespace tribin::picking {
namespace {

constexpr int kScansRemembered = 3;       // a grasp that failed is not tried again in so many
constexpr int kMostPushes = 5;            // in a row, without a pick
constexpr int kMostTurns = 3;             // at the station, of one part
constexpr double kTurned = 45 * kDegree;  // a part that is put back as it stood gains nothing
constexpr Chooser::Where kSlots[] = {Chooser::Where::slots};

/// Grasps of parts that this arm takes at least as well as the other one.
grasp::Plan better_ones(const grasp::Plan& plan, const grasp::Plan& of_other) {
  std::map<int, double> best;
  for (const grasp::Grasp& grasp : of_other.grasps) best[grasp.part] = std::max(best[grasp.part], grasp.score);
  std::map<int, double> own;
  for (const grasp::Grasp& grasp : plan.grasps) own[grasp.part] = std::max(own[grasp.part], grasp.score);
  grasp::Plan out = plan;
  std::erase_if(out.grasps, [&](const grasp::Grasp& grasp) { return best[grasp.part] > own[grasp.part]; });
  return out;
}

}  // namespace

Side::Side(const RunLinks& links, const RunOptions& options, std::size_t number)
    : chooser(*links.cell, *links.robot, *links.vision, links.limits, number),
      shake(options.handshake),
      arm(&arm_of(*links.cell, *links.robot, number)) {
  if (number > 0) shake.variables = {10, 10, 20};
}

const Entry* Side::held(const JournalState& state) const {
  const std::optional<Entry>& held = state.hand(chooser.arm_number()).in_hand;
  return held ? &*held : nullptr;
}

Chooser::Start Side::start() const {
  return {here.base_from_tcp * chooser.shape(gripper).gripper.flange_from_tcp.inverse(), here.joints};
}

std::vector<grasp::Convex> Side::bodies(const JournalState& state) const {
  return bodies_at(chooser.arm_with(gripper, held(state)), here.joints);
}

TwoArms::TwoArms(const RunLinks& links, const RunOptions& options) : links_(links), options_(options) {
  const WorkCell& cell = *links.cell;
  const auto want = [&cell](bool there, const std::string& saw, const char* wanted) {
    if (!there) throw Error(ErrorCode::bad_input, cell.file.string() + ": saw " + saw + ", wanted " + wanted);
  };
  want(cell.robots.size() == 2, std::to_string(cell.robots.size()) + " [[robot]]", "one or two");
  want(cell.mount() == CameraMount::fixed, "a camera on the flange", "a fixed one for two arms");
  for (std::size_t i = 0; i < 2; ++i) {
    const CellRobot& robot = cell.robots[i];
    const std::string name = "robot[" + std::to_string(i) + "]";
    want(robot.wait.has_value(), "no " + name + ".wait", "where it waits for the other arm");
    want(!robot.grippers.empty(), "no " + name + ".grippers", "those that sit on it");
    for (const std::string& gripper : robot.grippers)
      want(i == 0 || std::find(cell.robots[0].grippers.begin(), cell.robots[0].grippers.end(), gripper) ==
                         cell.robots[0].grippers.end(),
           gripper + " on both arms", "it on one");
    sides_.emplace_back(links, options, i);
  }
  want(cell.robots[0].model == cell.robots[1].model && cell.robots[0].arm != cell.robots[1].arm, "other arms",
       "two arms of one model: one controller drives both");
  if (now().filling.size() != sides_[0].chooser.slots().size())
    throw Error(ErrorCode::bad_input, links.journal->file().string() + ": saw a rack of " +
                                          std::to_string(now().filling.size()) + " slots, wanted one of " +
                                          std::to_string(sides_[0].chooser.slots().size()));
}

RunEnd TwoArms::go() {
  if (options_.entered) options_.entered(Phase::recover);
  if (!recover()) return end_;
  turn_waist();
  while (round()) {
  }
  return end_;
}

std::vector<int> TwoArms::holding() const {
  std::vector<int> arms;
  for (const int arm : {1, 2})
    if (now().hand(arm).in_hand) arms.push_back(arm);
  return arms;
}

bool TwoArms::finish(const std::string& status, const std::string& message) {
  end_.status = status;
  end_.message = message + (station_trouble_.empty() ? "" : "; " + station_trouble_);
  return false;
}

bool TwoArms::in_doubt(int arm, const std::string& what) {
  const HandState& hand = now().hand(arm);
  const std::optional<Entry>& about = hand.open ? hand.open : hand.in_hand;
  return finish("in_doubt", what + "; look at arm " + std::to_string(arm) +
                                (about ? ", its gripper and at slot " + std::to_string(about->slot) : "") +
                                ", take away what the gripper holds, move the arm to where it waits, then say "
                                "--slot-is full or --slot-is empty");
}

void TwoArms::tell(CycleReport& report, const std::string& state, const std::string& note) {
  report.state = state;
  report.scene = scene_;
  report.note = note;
  report.robot_s = links_.clock->now_s() - scan_s_;
  if (options_.told) options_.told(report);
}

bool TwoArms::scan() {
  if (options_.entered) options_.entered(Phase::scan);
  scene_ = std::max(scene_, now().last_scene) + 1;
  scan_s_ = links_.clock->now_s();
  sight_ = links_.vision->scan({});
  std::erase_if(failed_, [&](const auto& failed) { return scene_ - failed.first > kScansRemembered; });
  if (options_.entered) options_.entered(Phase::choose);
  if (!sight_.suspect.empty()) return finish("calibration_suspect", sight_.suspect);
  if (sight_.status == "empty") return finish("empty", "the bin is empty");
  if (sight_.status == "no_data") return finish("no_data", "the scan holds no measurement in the bin");
  return true;
}

/// The best grasp of the free arms that leads to a slot, clear of the other arm's errand.
std::optional<Errand> TwoArms::choose(std::vector<int> free, const Errand* beside) {
  Filling filling = now().filling;
  if (beside && beside->report.slot) filling[static_cast<std::size_t>(beside->report.slot) - 1] = beside->report.part;
  std::vector<grasp::FailedPick> failed;
  for (const auto& f : failed_) failed.push_back(f.second);
  StageTimes times;
  std::optional<Choice> best;
  int best_arm = 0;
  std::vector<grasp::WhyCount> reasons;
  {
    const StageTimer watch(times, "plan");
    std::array<grasp::Plan, 2> plans;
    for (const int arm : {1, 2}) {
      Side& one = side(arm);
      std::vector<grasp::Convex> others = beside && beside->arm != arm ? beside->room : other(arm).bodies(now());
      one.chooser.stand_among(waist_, others);
      links_.vision->plan_for({static_cast<std::size_t>(arm) - 1, waist_, std::move(others)});
      plans[static_cast<std::size_t>(arm) - 1] =
          links_.vision->plan(one.chooser.plan_options(resort_, failed), one.chooser.places(filling));
    }
    std::vector<std::string> why;
    for (const int arm : free) {
      const grasp::Plan& own = plans[static_cast<std::size_t>(arm) - 1];
      Side& one = side(arm);
      const grasp::Plan better = better_ones(own, plans[static_cast<std::size_t>(2 - arm)]);
      auto choice = one.chooser.choose(better, filling, one.start(), kSlots, {}, why);
      if (!choice) choice = one.chooser.choose(own, filling, one.start(), kSlots, {}, why);
      if (!choice && station_is_free(beside))
        choice = one.chooser.choose(own, filling, one.start(), kAllPlaces, {}, why);
      if (reasons.empty()) reasons = own.reasons;
      if (choice && !choice->placing.slot && best) continue;  // gripping anew takes longer
      if (choice && (!best || (choice->placing.slot && !best->placing.slot) || choice->grasp.score > best->grasp.score))
        best = choice, best_arm = arm;
    }
    why_ = why.empty() ? text_of(reasons) : text_of(why);
  }
  if (!best) return {};
  std::optional<Errand> errand = pick_errand(best_arm, *best);
  if (!errand) return {};
  errand->report.find_ms = sight_.find_ms, errand->report.seen = sight_.seen;
  errand->report.plan_ms = times.total(), errand->report.refused = reasons;
  return errand;
}

std::optional<Errand> TwoArms::push() {
  for (const int arm : {1, 2}) {
    Side& one = side(arm);
    one.chooser.stand_among(waist_, other(arm).bodies(now()));
    links_.vision->plan_for({static_cast<std::size_t>(arm) - 1, waist_, other(arm).bodies(now())});
    grasp::PlanOptions options = one.chooser.plan_options(Resort::push, {});
    options.grippers = one.chooser.own_grippers();
    for (const grasp::Push& push : links_.vision->plan_pushes(options).pushes)
      if (auto errand = push_errand(arm, push)) return errand;
  }
  return {};
}

/// Nobody holds a part, and nothing can be picked. \return whether something else is tried
bool TwoArms::nothing_to_pick() {
  if (resort_ < Resort::full_tilt) {
    resort_ = resort_ == Resort::none ? Resort::next_gripper : Resort::full_tilt;
    return true;
  }
  CycleReport report;
  report.seen = sight_.seen, report.find_ms = sight_.find_ms, report.resort = resort_;
  if (pushes_ < kMostPushes) {
    ++pushes_;
    if (auto errand = push()) {
      carry_out({*errand});
      resort_ = Resort::none;
      return true;
    }
  }
  tell(report, "no_pick", why_);
  if (std::all_of(sight_.seen.begin(), sight_.seen.end(), [](const auto& seen) { return seen.second == 0; }))
    return finish("not_empty_no_object", "something lies in the bin, and no part is found in it");
  return finish("not_pickable", "no part can be picked: " + why_);
}

bool TwoArms::station_is_free(const Errand* beside) const {
  return sides_[0].chooser.has_station() && !now().at_station && !(beside && beside->report.slot == 0);
}

bool TwoArms::regrasp() {
  const Entry standing = *now().at_station;
  const auto give_up = [&](const std::string& why) {  // the others go on without a station
    station_trouble_ = standing.part + " stands at the station and " + why + ": take it away, then say --slot-is empty";
    turns_ = 0;
    CycleReport report;
    tell(report, "no_pick", station_trouble_);
    return true;
  };
  std::string why = "no gripper is free";
  for (const int arm : {standing.arm, 3 - standing.arm}) {
    if (now().hand(arm).in_hand) continue;
    Side& one = side(arm);
    one.chooser.stand_among(waist_, other(arm).bodies(now()));
    links_.vision->plan_for({static_cast<std::size_t>(arm) - 1, waist_, other(arm).bodies(now())});
    grasp::PlanOptions options = one.chooser.plan_options(Resort::full_tilt, {});
    for (const auto& f : failed_) options.failed.push_back(f.second);
    const grasp::Plan plan = links_.vision->plan_standing(standing.part, standing.base_from_part, options,
                                                          one.chooser.places(now().filling));
    why = "no grasp leads from there to a slot (" + text_of(plan.reasons) + ")";
    for (const Chooser::Where where : kAllPlaces)
      for (const grasp::Grasp& grasp : plan.grasps) {
        Choice choice{grasp, {}, {}};
        choice.part.base_from_part = standing.base_from_part;
        auto placing = one.chooser.place_after(grasp, now().filling, one.start(), where);
        if (!placing) continue;
        const Pose turn = placing->base_from_part.inverse() * standing.base_from_part;
        if (where != Chooser::Where::slots &&
            (rotation_angle(turn.linear(), Matrix3::Identity()) < kTurned || turns_ >= kMostTurns))
          continue;
        choice.placing = std::move(*placing);
        std::optional<Errand> errand = pick_errand(arm, choice);
        if (!errand) continue;
        errand->zones = {robot::Zone::bin, robot::Zone::rack};
        for (Move& move : errand->moves)
          if (move.command == robot::CycleCommand::pick) move.entry.from_station = true;
        turns_ = where == Chooser::Where::slots ? 0 : turns_ + 1;
        carry_out({*errand});
        return now().hand(arm).in_hand ? true : give_up("is not gripped, so that it does not stand there as it should");
      }
  }
  return give_up(why);
}

bool TwoArms::round() {
  const std::vector<int> hold = holding();
  const auto open = open_slots(sides_[0].chooser.slots(), now().filling, links_.cell->rack->when_missing);
  const int most = options_.most_parts, held = static_cast<int>(hold.size());
  if (hold.empty() && open.empty()) return finish("rack_full", "every slot of the rack holds a part");
  if (hold.empty() && most > 0 && end_.placed >= most)
    return finish("most_parts", std::to_string(end_.placed) + " parts are placed, as many as were asked for");
  if (now().at_station && station_trouble_.empty() && held < 2) return regrasp();
  std::optional<Errand> at_rack;
  if (!hold.empty()) {
    at_rack = place_errand(hold.front());
    if (!at_rack)
      return in_doubt(hold.front(), "arm " + std::to_string(hold.front()) + " holds " +
                                        now().hand(hold.front()).in_hand->part +
                                        ", and no open slot can be reached with it");
  }
  const bool wanted = held < 2 && static_cast<int>(open.size()) > held && (most == 0 || end_.placed + held < most);
  std::optional<Errand> in_bin;
  if (wanted) {
    const bool good = scan();
    if (!good && !at_rack) return false;
    std::vector<int> free{1, 2};
    if (at_rack) free = {3 - at_rack->arm};
    if (good) in_bin = choose(free, at_rack ? &*at_rack : nullptr);
    if (good && !in_bin && !at_rack) return nothing_to_pick();
  }
  std::vector<Errand> errands;
  if (at_rack) errands.push_back(std::move(*at_rack));
  if (in_bin) errands.push_back(std::move(*in_bin));
  carry_out(std::move(errands));
  if (failures_ >= kMostFailures && holding().empty())
    return finish("not_pickable", std::to_string(failures_) + " grips in a row held nothing; look at the grippers");
  return true;
}

RunEnd pick_with_two_arms(const RunLinks& links, const RunOptions& options) { return TwoArms(links, options).go(); }

}  // namespace tribin::picking
