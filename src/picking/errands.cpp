// What one of two arms does in a zone: planned as a whole, then carried out beside the other's.
#include <algorithm>

#include "picking/two_arms.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

constexpr int kPushClass = 255;     // B002 of a push, for jobs that close the jaws then
constexpr double kClosed_mm = 0.1;  // an opening that is said, and closed

Entry move_entry(int arm, int scene) {
  Entry entry;
  entry.event = Event::move_ordered;
  entry.arm = arm;
  entry.scene = scene;
  return entry;
}

}  // namespace

/// Way points to a place; `whole`: and that itself.
bool TwoArms::add_way(Errand& errand, Chooser::Start& at, const Pose& base_from_tcp, bool whole, const Entry* held) {
  const Chooser& chooser = side(errand.arm).chooser;
  auto stops = chooser.whole_way(at, base_from_tcp, errand.gripper, held);
  if (!stops) return false;
  if (!whole) stops->pop_back();
  if (stops->empty()) return true;
  at = {stops->back().base_from_tcp * chooser.shape(errand.gripper).gripper.flange_from_tcp.inverse(),
        stops->back().joints};
  for (std::size_t i = 0; i < stops->size(); i += kMostStops)
    errand.moves.push_back({move_entry(errand.arm, scene_),
                            robot::CycleCommand::way_points,
                            {stops->begin() + static_cast<std::ptrdiff_t>(i),
                             stops->begin() + static_cast<std::ptrdiff_t>(std::min(i + kMostStops, stops->size()))},
                            0,
                            0});
  return true;
}

/// The way back, and the room of all of it.
bool TwoArms::close_errand(Errand& errand, Chooser::Start at, const Entry* held) {
  const Side& one = side(errand.arm);
  if (!add_way(errand, at, one.chooser.next_place(errand.gripper, at), true, held)) return false;
  std::vector<Stop> all{one.here};
  for (const Move& move : errand.moves) all.insert(all.end(), move.stops.begin(), move.stops.end());
  all.front().base_from_tcp = one.start().base_from_flange * one.chooser.shape(errand.gripper).gripper.flange_from_tcp;
  const ArmWithTool arm = one.chooser.arm_with(errand.gripper, held ? held : one.held(now()));
  errand.room = room_of_way(arm, all.front(), all);
  return true;
}

std::optional<Errand> TwoArms::place_errand(int arm) {
  Side& one = side(arm);
  const Entry held = *now().hand(arm).in_hand;
  one.chooser.stand_among(waist_, other(arm).bodies(now()));
  std::optional<Placing> placing;
  for (const Chooser::Where where : kAllPlaces)
    if (!placing && (where == Chooser::Where::slots || station_is_free(nullptr)))
      placing = one.chooser.place(held, now().filling, one.start(), where);
  if (!placing) return {};
  Errand errand;
  errand.arm = arm, errand.zones = {robot::Zone::rack}, errand.gripper = held.gripper;
  Chooser::Start at = one.start();
  if (!add_way(errand, at, placing->stops[0].base_from_tcp, false, &held)) return {};
  Entry entry = held;
  entry.event = Event::place_ordered;
  entry.slot = placing->slot ? placing->slot->number : 0;
  entry.from_station = false;
  entry.base_from_part = placing->base_from_part;
  errand.moves.push_back(
      {entry, robot::CycleCommand::place, {placing->stops.begin(), placing->stops.end()}, held.opening_mm, 0});
  at = {placing->stops[2].base_from_tcp * one.chooser.shape(held.gripper).gripper.flange_from_tcp.inverse(),
        placing->stops[2].joints};
  if (!close_errand(errand, at, nullptr)) return {};
  CycleReport& report = errand.report = std::exchange(one.picked, {});
  report.arm = arm, report.part = held.part, report.gripper = held.gripper, report.grasp = held.grasp;
  report.slot = entry.slot, report.base_from_part = held.base_from_part;
  return errand;
}

std::optional<Errand> TwoArms::pick_errand(int arm, const Choice& choice) {
  Side& one = side(arm);
  const grasp::Grasp& grasp = choice.grasp;
  Errand errand;
  errand.arm = arm, errand.zones = {robot::Zone::bin}, errand.gripper = grasp.gripper;
  Chooser::Start at = one.start();
  if (!add_way(errand, at, grasp.path.front().base_from_tcp, false, nullptr)) return {};
  if (const grasp::PathPoint* entry = grasp.at(grasp::Step::entry))
    errand.moves.push_back(
        {move_entry(arm, scene_), robot::CycleCommand::way_points, {{entry->base_from_tcp, entry->joints}}, 0, 0});
  Entry entry = pick_of(choice, scene_);
  entry.arm = arm;
  std::vector<Stop> stops;
  for (const grasp::Step step : {grasp::Step::pre_pick, grasp::Step::pick, grasp::Step::retreat})
    stops.push_back({grasp.at(step)->base_from_tcp, grasp.at(step)->joints});
  at = {stops.back().base_from_tcp * one.chooser.shape(grasp.gripper).gripper.flange_from_tcp.inverse(),
        stops.back().joints};
  const int part_class = static_cast<int>(&one.chooser.cell_part(grasp.part_name) - links_.cell->parts.data()) + 1;
  errand.moves.push_back({entry, robot::CycleCommand::pick, stops, grasp.opening_before_mm, part_class});
  if (!close_errand(errand, at, &entry)) return {};
  CycleReport& report = errand.report;
  report.arm = arm, report.part = grasp.part_name, report.gripper = grasp.gripper, report.grasp = grasp.family;
  report.slot = entry.slot, report.resort = resort_;
  report.base_from_part = entry.base_from_part, report.base_from_tcp = stops[1].base_from_tcp;
  report.score = grasp.score, report.terms = grasp.terms;
  return errand;
}

std::optional<Errand> TwoArms::push_errand(int arm, const grasp::Push& push) {
  Side& one = side(arm);
  Errand errand;
  errand.arm = arm, errand.zones = {robot::Zone::bin}, errand.gripper = push.gripper;
  std::vector<Pose> poses;
  for (const grasp::PathPoint& point : push.path) poses.push_back(point.base_from_tcp);
  const auto stops = stops_at(one.chooser.arm_with(push.gripper), poses);
  Chooser::Start at = one.start();
  if (!stops || stops->size() > kMostStops || !add_way(errand, at, poses.front(), false, nullptr)) return {};
  Entry entry = move_entry(arm, scene_);
  entry.note = "push " + push.part_name;
  errand.moves.push_back({entry, robot::CycleCommand::way_points, *stops, kClosed_mm, kPushClass});
  at = {stops->back().base_from_tcp * one.chooser.shape(push.gripper).gripper.flange_from_tcp.inverse(),
        stops->back().joints};
  if (!close_errand(errand, at, nullptr)) return {};
  errand.report.arm = arm, errand.report.part = push.part_name, errand.report.gripper = push.gripper;
  return errand;
}

void TwoArms::begin(Errand& errand) {
  Side& one = side(errand.arm);
  const Move move = errand.moves.front();
  errand.moves.pop_front();
  Entry entry = move.entry;
  entry.cycle = robot::next_cycle(now().hand(errand.arm).last_cycle);
  robot::CycleOrder order = order_of(entry, move.command, one.chooser, *one.arm, move.stops, errand.gripper);
  order.opening_mm = move.opening_mm;
  order.part_class = move.part_class;
  links_.journal->write(entry);
  errand.open = entry;
  one.gripper = errand.gripper;
  one.here = move.stops.back();
  robot::begin_cycle(*links_.controller, *links_.clock, order, one.shake);
}

void TwoArms::end(Errand& errand, robot::CycleResult result) {
  const Entry order = *std::exchange(errand.open, std::nullopt), end = end_of(order, result);
  links_.journal->write(end);
  must_be_no_fault(order, result);
  CycleReport& report = errand.report;
  report.cycle = order.cycle;
  if (!order.note.empty()) tell(report, "pushed", why_);
  if (end.event == Event::picked) {
    failures_ = pushes_ = 0, resort_ = Resort::none;
    side(errand.arm).picked = report;
  }
  if (end.event == Event::missed) {
    ++failures_;
    failed_.push_back({scene_, {report.base_from_tcp, report.gripper}});
    tell(report, "missed", order.from_station ? "at the station" : "");
  }
  if (end.event == Event::lost)
    tell(report, "lost", "the part was not in the gripper any more when it came to its place");
  if (end.event == Event::placed) {
    end_.placed += order.slot > 0;
    tell(report, order.slot > 0 ? "placed" : "put_down");
  }
}

void TwoArms::carry_out(std::vector<Errand> errands) {
  const auto is_at_rack = [](const Errand& errand) { return errand.zones.back() == robot::Zone::rack; };
  const bool places = std::any_of(errands.begin(), errands.end(), is_at_rack);
  if (options_.entered) options_.entered(places ? Phase::place : Phase::pick);
  robot::Controller& controller = *links_.controller;
  robot::Clock& clock = *links_.clock;
  for (const Errand& errand : errands)
    for (const robot::Zone zone : errand.zones) hand_zone(controller, clock, zone, errand.arm, options_.handshake);
  for (bool busy = true; busy;) {
    busy = false;
    for (Errand& errand : errands) {
      if (errand.open) {
        const auto result = look_at_cycle(controller, clock, errand.open->cycle, side(errand.arm).shake);
        if (result) end(errand, *result);
      }
      if (!errand.open && !errand.moves.empty()) begin(errand);
      if (!errand.open && !errand.home) {
        for (const robot::Zone zone : errand.zones) hand_zone(controller, clock, zone, 0, options_.handshake);
        errand.home = true;
      }
      busy = busy || !errand.home;
    }
    if (busy) clock.sleep_s(options_.handshake.poll_s);
  }
}

}  // namespace tribin::picking
