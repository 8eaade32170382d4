#include "sim/cell_world.hpp"

#include <algorithm>
#include <cmath>

#include "sim/grip.hpp"
#include "sim/solid.hpp"
#include "tribin/core/error.hpp"
#include "tribin/grasp/grasp.hpp"
#include "tribin/kinematics/inverse.hpp"
#include "tribin/picking/place.hpp"
#include "tribin/picking/vision.hpp"
#include "tribin/robot/handshake.hpp"

namespace tribin::sim {
namespace {

constexpr double kStep = 1.0 / 240;              // s, of the physics
constexpr double kLook_mm = 1, kArmLook_mm = 5;  // ways between looks for contacts
constexpr double kNearBin_mm = 60;               // above the rim: beyond, nothing in the bin can be touched
constexpr double kInSlot_mm = 25;                // a part let go farther from a slot's place falls
constexpr double kMoved_mm = 2;

/// Of the hand-shake: the second arm has its own, ten on.
int variable_of(int number, int arm) { return number + 10 * (arm - 1); }

}  // namespace

CellWorld::CellWorld(const WorkCell& cell, const robot::RobotModel& robot, const CellStock& stock,
                     const SimulatedCellOptions& options)
    : cell_(cell),
      robot_(robot),
      stock_(stock),
      options_(options),
      random_(mixed(options.seed) ^ 0xCE11u),
      field_(options.robot_mm, options.seed),
      base_from_bin_(cell.bin->base_from_bin) {
  parent_from_camera_ =
      cell.hand_eye.parent_from_camera * drawn_motion(options.hand_eye_mm, options.hand_eye_rad, random_);
  for (std::size_t i = 0; i < std::max<std::size_t>(cell.robots.size(), 1); ++i) {
    MovingArm arm;
    arm.number = static_cast<int>(i) + 1;
    arm.arm = &picking::arm_of(cell, robot, i);
    arms_.push_back(arm);
  }
  if (cell.rack) slots_ = picking::slots_of(*cell.rack);
  drop_parts(options);
  add_tools(cell);
}

Pose CellWorld::true_tcp(const controller_sim::Machine& machine, int arm) const {
  Pose pose = robot::pose_of(machine.position(arm));
  pose.translation() += field_.error_at(pose.translation());
  return pose;
}

CellWorld::Tool& CellWorld::tool_of(MovingArm& arm, const controller_sim::Machine& machine) {
  const int number = std::clamp(machine.position(arm.number).tool - 1, 0, static_cast<int>(tools_.size()) - 1);
  if (number != arm.tool && arm.tool >= 0) {  // the other gripper is put away
    Pose away = Pose::Identity();
    away.translation() = Vec3::Constant(1e5);
    for (const int body : tools_[arm.tool].bodies) heap_->move(body, away);
  }
  arm.tool = number;
  return tools_[number];
}

bool CellWorld::is_held(int part) const {
  return std::any_of(arms_.begin(), arms_.end(), [part](const MovingArm& arm) { return arm.held == part; });
}

void CellWorld::place_bodies(const MovingArm& arm) {
  const Tool& tool = tools_[arm.tool];
  const Pose bin_from_tcp = base_from_bin_.inverse() * arm.base_from_tcp;
  for (std::size_t i = 0; i < tool.bodies.size(); ++i) {
    Pose piece = bin_from_tcp;
    piece.translation() += bin_from_tcp.linear() * (tool.opening_mm * tool.shape.pieces[i].travel);
    heap_->move(tool.bodies[i], piece);
  }
  if (arm.held >= 0) heap_->move(arm.held, bin_from_tcp * arm.tcp_from_held);
}

/// A command says how far the jaws are to be open: I003, in tenths of a millimetre; 0 = as far as they go.
void CellWorld::set_opening(Tool& tool, const controller_sim::Machine& machine, int arm) {
  if (tool.shape.jaws == 0) return;
  const auto said = machine.integers.find(variable_of(3, arm));
  const double low = tool.shape.stroke_min(), high = tool.shape.stroke_max();
  const double wanted = said == machine.integers.end() ? 0 : said->second / 10.0;
  tool.opening_mm = wanted > 0 ? std::clamp(wanted, low, high) : tool.shape.inside ? low : high;
}

void CellWorld::take_command(MovingArm& arm, const controller_sim::Machine& machine) {
  Tool& tool = tool_of(arm, machine);
  const auto taken = machine.integers.find(variable_of(1, arm.number));
  const int cycle = taken == machine.integers.end() ? 0 : taken->second;
  if (cycle == arm.cycle) return;
  arm.cycle = cycle;
  const auto command = machine.bytes.find(variable_of(0, arm.number));
  const bool picks = command != machine.bytes.end() && command->second == 1;
  if (arm.held < 0 && (picks || in_push(machine, arm.number))) set_opening(tool, machine, arm.number);
}

void CellWorld::step_physics(double until_s) {
  for (; physics_s_ + kStep <= until_s; physics_s_ += kStep) {
    if (heap_->at_rest()) {
      heap_->step();  // wakes what is touched
      if (heap_->at_rest()) {
        physics_s_ += std::floor((until_s - physics_s_) / kStep) * kStep;
        break;
      }
    } else {
      heap_->step();
    }
  }
}

void CellWorld::follow(const controller_sim::Machine& machine) {
  truth_.simulated_s = machine.now_s();
  for (MovingArm& arm : arms_) {
    take_command(arm, machine);
    arm.base_from_tcp = true_tcp(machine, arm.number);
    place_bodies(arm);
  }
  step_physics(machine.now_s());
  bool moved = false;
  for (MovingArm& arm : arms_) {
    const Vec3 here = arm.base_from_tcp.translation();
    if ((here - arm.looked_at).norm() >= kLook_mm) {
      arm.looked_at = here;
      find_contacts(arm, machine);
    }
    if ((here - arm.arm_looked_at).norm() >= kArmLook_mm) {
      arm.arm_looked_at = here;
      find_arm_contacts(arm, machine);
      moved = true;
    }
  }
  if (moved && arms_.size() > 1) find_contacts_of_arms(machine);
}

std::optional<Pose> CellWorld::waist_turn(const controller_sim::Machine& machine) {
  const auto is = machine.integers.find(robot::kWaistIs);
  const double angle = is == machine.integers.end() ? 0 : is->second / 10.0 * kDegree;
  if (angle == waist_) return {};
  const Pose before = base_from_arm(robot_, *arms_.front().arm, waist_);
  waist_ = angle;
  return Pose(base_from_arm(robot_, *arms_.front().arm, waist_) * before.inverse());
}

bool CellWorld::close(const controller_sim::Machine& machine, int number) {
  follow(machine);
  MovingArm& arm = arms_.at(static_cast<std::size_t>(number) - 1);
  Tool& tool = tool_of(arm, machine);
  ++truth_.grips;
  const Pose tcp_from_bin = (base_from_bin_.inverse() * arm.base_from_tcp).inverse();
  std::string why = "nothing is there";
  int touched = 0;
  for (int part = 0; part < heap_->parts(); ++part) {
    if (is_held(part) && part != arm.held) continue;
    const Pose tcp_from_part = tcp_from_bin * heap_->pose(part);
    const CellPart& of = cell_.parts[class_of_[part]];
    if (tcp_from_part.translation().norm() > 2 * heap_->solid(part).diameter_mm() + tool.shape.stroke_max()) continue;
    const Grip grip = close_gripper(tool.shape, tool.opening_mm, heap_->solid(part), tcp_from_part,
                                    tool.shape.gripper.friction, of.mass_kg);
    touched += grip.touches;
    if (!grip.why.empty() && grip.touches) why = of.name + ": " + grip.why;
    if (!grip.holds || arm.held >= 0) continue;
    arm.held = part;
    const Pose slip = drawn_motion(options_.slip_mm, options_.slip_rad, random_);
    arm.tcp_from_held = grip.motion * tcp_from_part;
    arm.tcp_from_held.linear() = slip.linear() * arm.tcp_from_held.linear();
    arm.tcp_from_held.translation() += slip.translation();
    tool.opening_mm = grip.opening_mm;
  }
  if (arm.held >= 0 && touched > 1) {
    arm.held = -1;
    why = "two parts are between the jaws";
  }
  if (arm.held < 0) {
    truth_.failed_grips.push_back(why);
    return false;
  }
  heap_->hold(arm.held);
  truth_.parts[arm.held].where = Whereabouts::in_hand;
  place_bodies(arm);
  return true;
}

void CellWorld::note_placed(int part, int slot, const Pose& base_from_wanted) {
  PartTruth& truth = truth_.parts[part];
  const Pose here = base_from_bin_ * heap_->pose(part);
  truth.slot = slot;
  truth.off_mm = (here.translation() - base_from_wanted.translation()).norm();
  truth.off_rad = rotation_angle(here.linear(), base_from_wanted.linear());
}

void CellWorld::open(const controller_sim::Machine& machine, int number) {
  follow(machine);
  MovingArm& arm = arms_.at(static_cast<std::size_t>(number) - 1);
  Tool& tool = tool_of(arm, machine);
  const int part = std::exchange(arm.held, -1);
  set_opening(tool, machine, number);
  if (part < 0) return;
  PartTruth& truth = truth_.parts[part];
  const Pose& slot_from_part = cell_.parts[class_of_[part]].slot_from_part;
  const Pose here = base_from_bin_ * heap_->pose(part);
  const auto is_at = [&](const Pose& wanted) {
    return (wanted.translation() - here.translation()).norm() < kInSlot_mm;
  };
  for (const Pose& stands : picking::station_poses(cell_, cell_.parts[class_of_[part]])) {
    if (!is_at(stands)) continue;
    truth.where = Whereabouts::at_station;
    heap_->stand(part);
    return;
  }
  const picking::Slot* nearest = nullptr;
  double best = kInSlot_mm;
  for (const picking::Slot& slot : slots_) {
    const double off = ((slot.base_from_slot * slot_from_part).translation() - here.translation()).norm();
    if (off < best) best = off, nearest = &slot;
  }
  if (nearest) {
    truth.where = Whereabouts::placed;
    ++truth.times_placed;
    note_placed(part, nearest->number, nearest->base_from_slot * slot_from_part);
    heap_->stand(part);
    return;
  }
  const Vec3 in_bin = heap_->pose(part).translation(), size = cell_.bin->inner_size_mm;
  if (std::abs(in_bin.x()) < size.x() / 2 && std::abs(in_bin.y()) < size.y() / 2) {
    truth.where = Whereabouts::in_bin;
    heap_->let_go(part);
  } else {
    truth.where = Whereabouts::lost;
    heap_->stand(part);
  }
}

Pose CellWorld::base_from_camera() const {
  if (cell_.mount() == CameraMount::fixed) return parent_from_camera_;
  const auto tool = static_cast<std::size_t>(std::max(arms_.front().tool, 0));
  return arms_.front().base_from_tcp * cell_.grippers[tool].flange_from_tcp.inverse() * parent_from_camera_;
}

bool CellWorld::reachable(const Pose& base_from_tcp, int tool) const {
  const auto number = static_cast<std::size_t>(std::clamp(tool - 1, 0, static_cast<int>(tools_.size()) - 1));
  const robot::Arm& arm = *arms_.front().arm;
  return reach(arm, base_from_arm(robot_, arm, waist_).inverse() * base_from_tcp *
                        cell_.grippers[number].flange_from_tcp.inverse())
      .has_value();
}

const CellTruth& CellWorld::truth() {
  for (int i = 0; i < heap_->parts(); ++i) truth_.parts[i].base_from_part = base_from_bin_ * heap_->pose(i);
  return truth_;
}

std::vector<CellWorld::Standing> CellWorld::standing() const {
  std::vector<Standing> out;
  for (int i = 0; i < heap_->parts(); ++i)
    if (!is_held(i)) out.push_back({class_of_[i], base_from_bin_ * heap_->pose(i)});
  return out;
}

std::vector<CellWorld::Carried> CellWorld::carried() const {
  std::vector<Carried> out;
  for (const MovingArm& arm : arms_) {
    if (arm.joints)
      for (const grasp::Convex& link : grasp::arm_bodies(robot_, *arm.arm, waist_, *arm.joints))
        out.push_back({mesh_of(link), Pose::Identity()});
    if (arm.tool >= 0)
      for (const grasp::Convex& piece : grasp::pieces_at(tools_[arm.tool].shape, tools_[arm.tool].opening_mm))
        out.push_back({mesh_of(piece), arm.base_from_tcp});
    if (arm.held >= 0) out.push_back({heap_->solid(arm.held).mesh(), arm.base_from_tcp * arm.tcp_from_held, true});
  }
  return out;
}

void CellWorld::note_scan() {
  for (int i = 0; i < heap_->parts(); ++i) {
    if (truth_.parts[i].where != Whereabouts::in_bin || at_scan_.empty()) continue;
    truth_.disturbed += largest_motion(heap_->solid(i), at_scan_[i], heap_->pose(i)) > kMoved_mm;
  }
  at_scan_.clear();
  for (int i = 0; i < heap_->parts(); ++i) at_scan_.push_back(heap_->pose(i));
}

}  // namespace tribin::sim
