// Commands to the robot: the journal first, then the hand-shake, then the journal again.
#include <algorithm>

#include "picking/run.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {

const Chooser::Start& Run::here() {
  if (!here_) {
    here_ = Chooser::Start{robot::pose_of(links_.controller->position()) * gripper_now().flange_from_tcp.inverse(), {}};
  }
  return *here_;
}

robot::CycleOrder order_of(const Entry& entry, robot::CycleCommand command, const Chooser& chooser,
                           const robot::Arm& arm, const std::vector<Stop>& stops, const std::string& gripper) {
  robot::CycleOrder order;
  order.command = command;
  order.cycle = entry.cycle;
  const int frame = chooser.waits() ? 0 : 1;
  for (const Stop& stop : stops)
    order.positions.push_back(robot::position_from_pose(stop.base_from_tcp, robot::form_bits(arm, stop.joints),
                                                        chooser.tool_of(gripper), frame));
  return order;
}

Entry end_of(const Entry& order, robot::CycleResult result) {
  Entry end = order;
  const bool done = result == robot::CycleResult::done;
  switch (order.event) {
    case Event::pick_ordered:
      end.event = done ? Event::picked : Event::missed;
      break;
    case Event::place_ordered:
      end.event = done ? Event::placed : Event::lost;
      break;
    default:
      end.event = Event::moved;
  }
  return end;
}

void must_be_no_fault(const Entry& order, robot::CycleResult result) {
  if (result == robot::CycleResult::fault)
    throw Error(ErrorCode::device, "the robot's job ended cycle " + std::to_string(order.cycle) +
                                       " with a fault; look at its pendant, then start again");
}

robot::CycleResult Run::order(Entry entry, robot::CycleCommand command, const std::vector<Stop>& stops,
                              const std::string& gripper, double opening_mm, int part_class) {
  entry.cycle = robot::next_cycle(now().last_cycle);
  robot::CycleOrder order = order_of(entry, command, chooser_, arm_of(*links_.cell, *links_.robot), stops, gripper);
  order.part_class = part_class;
  order.opening_mm = opening_mm;
  report_.cycle = order.cycle;
  journal_.write(entry);
  const robot::CycleResult result = robot::run_cycle(*links_.controller, *links_.clock, order, options_.handshake);
  here_ = Chooser::Start{stops.back().base_from_tcp * chooser_.shape(gripper).gripper.flange_from_tcp.inverse(),
                         stops.back().joints};
  journal_.write(end_of(entry, result));
  must_be_no_fault(entry, result);
  return result;
}

const Gripper& Run::gripper_now() const {
  const int tool = links_.controller->position().tool;
  const auto& grippers = links_.cell->grippers;
  return grippers[static_cast<std::size_t>(std::clamp(tool, 1, static_cast<int>(grippers.size())) - 1)];
}

/// Another gripper is longer, wider, or stands open: it is taken where nothing is in the way of either.
void Run::lift_to_change(const std::string& gripper) {
  const Gripper& now = gripper_now();
  if (now.name == gripper) return;
  Pose up = here().base_from_flange * now.flange_from_tcp;
  constexpr double kThere_mm = 1;
  if (up.translation().z() > chooser_.travel_mm() - kThere_mm) return;
  up.translation().z() = chooser_.travel_mm();
  const auto stop = stops_at(chooser_.arm_with(now.name), std::span(&up, 1), here().joints, false);
  if (!stop) return;  // the way itself says what is out of reach
  Entry entry;
  entry.event = Event::move_ordered;
  entry.scene = scene_;
  order(entry, robot::CycleCommand::way_points, *stop, now.name, 0, 0);
}

void Run::travel(const Pose& to, const std::string& gripper) {
  lift_to_change(gripper);
  const auto stops = chooser_.way(here(), to, gripper);
  if (!stops)
    throw Error(ErrorCode::device,
                "the way between bin and rack is out of the arm's reach; wanted way points "
                "(robot.way_points), or a workspace that holds it");
  if (stops->empty()) return;
  Entry entry;
  entry.event = Event::move_ordered;
  entry.scene = scene_;
  order(entry, robot::CycleCommand::way_points, *stops, gripper, 0, 0);
}

FlangePose Run::go_to_look() {
  const WorkCell& cell = *links_.cell;
  if (cell.mount() != CameraMount::hand) return {};
  const Gripper& gripper = gripper_now();
  const Pose to = cell.camera->looks[static_cast<std::size_t>(look_)] * gripper.flange_from_tcp;
  travel(to, gripper.name);
  ArmWithTool arm = chooser_.arm_with(gripper.name);
  arm.singularity = 0;  // a move of the joints
  const auto stop = stops_at(arm, std::span(&to, 1), here().joints, false);
  if (!stop)
    throw Error(ErrorCode::device, cell.file.string() + ": camera.looks[" + std::to_string(look_) +
                                       "]: saw a place out of the arm's reach or workspace, wanted one within");
  Entry entry;
  entry.event = Event::move_ordered;
  entry.scene = scene_;
  order(entry, robot::CycleCommand::way_points, *stop, gripper.name, 0, 0);
  return
      [this] { return Pose(robot::pose_of(links_.controller->position()) * gripper_now().flange_from_tcp.inverse()); };
}

void Run::step_aside() {
  const WorkCell& cell = *links_.cell;
  if (cell.mount() != CameraMount::fixed || !cell.bin) return;
  const Gripper& gripper = gripper_now();
  const Vec3 tcp =
      cell.bin->base_from_bin.inverse() * (here().base_from_flange * gripper.flange_from_tcp).translation();
  const Vec3 half = cell.bin->inner_size_mm / 2;
  if (std::abs(tcp.x()) > half.x() || std::abs(tcp.y()) > half.y()) return;
  Pose aside = chooser_.over_bin();
  aside.translation().head<2>() = chooser_.slots().front().base_from_slot.translation().head<2>();
  const auto stops = chooser_.whole_way(here(), aside, gripper.name);
  if (!stops || stops->size() > kMostStops) return;  // it is seen then, as something that is no part
  Entry entry;
  entry.event = Event::move_ordered;
  entry.scene = scene_;
  order(entry, robot::CycleCommand::way_points, *stops, gripper.name, 0, 0);
}

Entry pick_of(const Choice& choice, int scene) {
  const grasp::Grasp& grasp = choice.grasp;
  Entry entry;
  entry.event = Event::pick_ordered;
  entry.scene = scene;
  entry.part = grasp.part_name, entry.gripper = grasp.gripper, entry.grasp = grasp.family;
  entry.slot = choice.placing.slot ? choice.placing.slot->number : 0;
  entry.base_from_part = choice.part.base_from_part;
  entry.tcp_from_part = grasp.part_from_tcp.inverse();
  entry.opening_mm = grasp.opening_before_mm, entry.holds_mm = grasp.opening_mm;
  return entry;
}

bool Run::carry_out_pick(const Choice& choice, int scene, bool from_station) {
  const grasp::Grasp& grasp = choice.grasp;
  std::vector<Stop> stops;
  const grasp::PathPoint* entry_point = grasp.at(grasp::Step::entry);
  travel((entry_point ? *entry_point : *grasp.at(grasp::Step::pre_pick)).base_from_tcp, grasp.gripper);
  if (entry_point) {
    Entry entry;
    entry.event = Event::move_ordered;
    entry.scene = scene;
    order(entry, robot::CycleCommand::way_points, {{entry_point->base_from_tcp, entry_point->joints}}, grasp.gripper, 0,
          0);
  }
  for (const grasp::Step step : {grasp::Step::pre_pick, grasp::Step::pick, grasp::Step::retreat})
    stops.push_back({grasp.at(step)->base_from_tcp, grasp.at(step)->joints});
  Entry entry = pick_of(choice, scene);
  entry.from_station = from_station;
  grip_ = chooser_.grip_of(grasp.gripper, grasp.at(grasp::Step::pick)->base_from_tcp, entry.tcp_from_part,
                           choice.part.covariance, from_station);
  if (links_.cell->in_hand) entry.sigma_mm = chooser_.held(*grip_, entry.part, {}).sigma_mm();
  const int part_class = static_cast<int>(&chooser_.cell_part(grasp.part_name) - links_.cell->parts.data()) + 1;
  return order(entry, robot::CycleCommand::pick, stops, grasp.gripper, grasp.opening_before_mm, part_class) ==
         robot::CycleResult::done;
}

}  // namespace tribin::picking
