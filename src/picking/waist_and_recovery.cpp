// How two arms begin: what a crash left open, and the waist that carries both.
#include <algorithm>
#include <cmath>

#include "picking/two_arms.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

constexpr double kThere_mm = 1, kThere = 0.2 * kDegree;  // an arm stands where it waits
constexpr double kWaistStep = 5 * kDegree;

/// Tool poses that an arm wants to reach at the bin: looking down, a grid at half of its height.
std::vector<Pose> poses_at_bin(const CellBin& bin) {
  std::vector<Pose> poses;
  for (const double x : {-0.35, 0.0, 0.35})
    for (const double y : {-0.35, 0.0, 0.35}) {
      Pose pose = Pose::Identity();
      pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0));
      pose.translation() = bin.base_from_bin * Vec3(bin.inner_size_mm.cwiseProduct(Vec3(x, y, 0.5)));
      poses.push_back(pose);
    }
  return poses;
}

}  // namespace

double TwoArms::waist_now() { return links_.controller->read_integer(robot::kWaistIs) / 10.0 * kDegree; }

/// Where an arm stands, by the controller. \return false where the arm as described cannot stand there
bool TwoArms::ask_where(Side& one) {
  const robot::CartesianPosition at = links_.controller->position(0, one.chooser.arm_number());
  const auto& grippers = links_.cell->grippers;
  one.gripper = grippers[static_cast<std::size_t>(std::clamp(at.tool, 1, static_cast<int>(grippers.size())) - 1)].name;
  const Pose tcp = robot::pose_of(at);
  const auto stops = stops_at(one.chooser.arm_with(one.gripper), std::span(&tcp, 1), {}, false);
  if (!stops) return false;
  one.here = stops->front();
  return true;
}

/// An arm that a crash left on its way goes back to where it waits, if that is clear of the other one.
bool TwoArms::bring_home(Side& one, const Side& beside) {
  const Pose wait = one.chooser.next_place(one.gripper, one.start());
  if ((wait.translation() - one.here.base_from_tcp.translation()).norm() < kThere_mm &&
      rotation_angle(wait.linear(), one.here.base_from_tcp.linear()) < kThere)
    return true;
  const int arm = one.chooser.arm_number();
  const int in_bin = holder_of(*links_.controller, *links_.clock, robot::Zone::bin, options_.handshake);
  const int at_rack = holder_of(*links_.controller, *links_.clock, robot::Zone::rack, options_.handshake);
  if (in_bin != arm && at_rack != arm)
    return in_doubt(arm, "arm " + std::to_string(arm) + " does not stand where it waits, and has no zone");
  one.chooser.stand_among(waist_, beside.bodies(now()));
  Errand errand;
  errand.arm = arm, errand.gripper = one.gripper;
  if (in_bin == arm) errand.zones.push_back(robot::Zone::bin);
  if (at_rack == arm) errand.zones.push_back(robot::Zone::rack);
  if (!close_errand(errand, one.start(), one.held(now())))
    return in_doubt(arm, "arm " + std::to_string(arm) + " finds no way back to where it waits");
  carry_out({errand});
  return true;
}

bool TwoArms::recover() {
  robot::Controller& controller = *links_.controller;
  if (options_.answer)
    for (const int arm : {1, 2}) {  // about the arm that was asked for: the first with something open
      const HandState& hand = now().hand(arm);
      if (!hand.open && !(hand.in_hand && !now().hand(3 - arm).open)) continue;
      Entry said = hand.open ? *hand.open : *hand.in_hand;
      said.event = Event::operator_said;
      said.cycle = 0, said.arm = arm;
      if (*options_.answer == Answer::slot_empty || !said.slot) said.part.clear();
      links_.journal->write(said);
      break;
    }
  for (Side& one : sides_) {
    const int arm = one.chooser.arm_number();
    if (!now().hand(arm).open) continue;
    const Entry open = *now().hand(arm).open;
    if (!settle(links_, one.shake, arm))
      return in_doubt(arm, what_was_ordered(open) + " (arm " + std::to_string(arm) + ", cycle " +
                               std::to_string(open.cycle) +
                               ") was ordered, and the controller does not tell how it ended");
  }
  if (options_.recover_only) return finish("recovered", "nothing is open");
  waist_ = waist_now();
  for (Side& one : sides_) {
    one.chooser.stand_among(waist_, {});
    if (!ask_where(one))
      return in_doubt(one.chooser.arm_number(), "arm " + std::to_string(one.chooser.arm_number()) +
                                                    " stands where it cannot, by its file and the waist's angle");
  }
  // At the rack first: there is more room.
  const int at_rack = holder_of(controller, *links_.clock, robot::Zone::rack, options_.handshake);
  for (const int arm : {at_rack == 2 ? 2 : 1, at_rack == 2 ? 1 : 2})
    if (!bring_home(side(arm), other(arm))) return false;
  for (const robot::Zone zone : {robot::Zone::bin, robot::Zone::rack})
    hand_zone(controller, *links_.clock, zone, 0, options_.handshake);
  return true;
}

/// The waist has one owner, the first arm's job, and stands still while parts are handled. It turns to where both arms
/// reach the bin best, and then the most slots; the least turn of equal ones.
void TwoArms::turn_waist() {
  if (!links_.robot->waist || !links_.cell->bin || !holding().empty()) return;
  const std::vector<Pose> at_bin = poses_at_bin(*links_.cell->bin);
  const robot::JointRange& range = links_.robot->waist->range;
  std::array<int, 2> best{-1, -1};
  double angle = waist_;
  const int steps = static_cast<int>(std::floor(std::min(range.max, -range.min) / kWaistStep));
  for (int i = 0; i <= 2 * steps; ++i) {  // 0, 5, -5, 10, ...
    const double at = (i % 2 ? 1 : -1) * ((i + 1) / 2) * kWaistStep;
    int worst = 1 << 30, slots = 0;
    for (Side& one : sides_) {
      one.chooser.stand_among(at, {});
      const ArmWithTool arm = one.chooser.arm_with(one.chooser.own_grippers().front());
      const auto reached = [&](const Pose& pose) { return stops_at(arm, std::span(&pose, 1)).has_value(); };
      worst = std::min(worst, static_cast<int>(std::count_if(at_bin.begin(), at_bin.end(), reached)));
      for (const Slot& slot : one.chooser.slots()) {
        Pose pose = slot.base_from_slot;
        pose.linear() = slot.base_from_slot.linear() * rotation_from_vector(Vec3(kPi, 0, 0));
        slots += reached(pose);
      }
    }
    if (std::array{worst, slots} > best) best = {worst, slots}, angle = at;
  }
  for (Side& one : sides_) one.chooser.stand_among(waist_, {});
  if (std::abs(angle - waist_) < kThere) return;
  Entry entry;
  entry.event = Event::move_ordered;
  entry.cycle = robot::next_cycle(now().last_cycle);
  entry.note = "waist";
  robot::CycleOrder order;
  order.command = robot::CycleCommand::turn_waist;
  order.cycle = entry.cycle;
  order.waist_rad = angle;
  links_.journal->write(entry);
  const robot::CycleResult result = run_cycle(*links_.controller, *links_.clock, order, sides_[0].shake);
  links_.journal->write(end_of(entry, result));
  must_be_no_fault(entry, result);
  waist_ = waist_now();
  for (Side& one : sides_) {
    one.chooser.stand_among(waist_, {});
    if (!ask_where(one)) throw Error(ErrorCode::device, "the arms do not stand where the waist should have taken them");
  }
}

}  // namespace tribin::picking
