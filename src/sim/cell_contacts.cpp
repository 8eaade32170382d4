// What touches what it must not: gripper, part in the hand and arm against bin and parts.
#include "sim/cell_world.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/grasp/grasp.hpp"
#include "tribin/kinematics/inverse.hpp"
#include "tribin/picking/place.hpp"

namespace tribin::sim {
namespace {

// The distance fields are right within half a cell of 1 mm: what lies deeper in another body touches it.
constexpr double kTouches_mm = 0.5;
constexpr double kHeldTouches_mm = 1;  // a part in the hand may have leant on a wall: the heap keeps 0.5 mm

}  // namespace

void CellWorld::note(const std::string& what, double depth_mm, const controller_sim::Machine& machine, int arm) {
  const int cycle = arms_[static_cast<std::size_t>(arm) - 1].cycle;
  if (noted_.insert({cycle, what}).second) truth_.collisions.push_back({machine.now_s(), cycle, what, depth_mm});
}

bool CellWorld::in_push(const controller_sim::Machine& machine, int arm) const {
  const auto of_class = machine.bytes.find(2 + 10 * (arm - 1));
  return of_class != machine.bytes.end() && of_class->second == kPushClass;
}

void CellWorld::find_contacts(const MovingArm& arm, const controller_sim::Machine& machine) {
  const Tool& tool = tools_[arm.tool];
  const auto name = [&](int part) { return truth_.parts[part].part + " " + std::to_string(part + 1); };
  for (std::size_t i = 0; i < tool.bodies.size(); ++i) {
    const std::string piece = tool.shape.gripper.name + " piece " + std::to_string(i + 1);
    const double in_wall = heap_->depth_in_walls_mm(tool.bodies[i]);
    if (in_wall > kTouches_mm) note(piece + " and the bin", in_wall, machine, arm.number);
    const bool jaw = tool.shape.pieces[i].jaw;
    if (jaw && in_push(machine, arm.number)) continue;
    const double allowed = jaw && tool.shape.jaws == 0 ? 3 : kTouches_mm;  // a cup's lip gives way
    for (int part = 0; part < heap_->parts(); ++part) {
      if (part == arm.held) continue;
      const std::optional<double> depth = heap_->depth_mm(tool.bodies[i], part, kTouches_mm);
      if (depth && *depth > allowed) note(piece + " and " + name(part), *depth, machine, arm.number);
    }
  }
  if (arm.held < 0) return;
  const double in_wall = heap_->depth_in_walls_mm(arm.held);
  if (in_wall > kHeldTouches_mm) note(name(arm.held) + " in hand and the bin", in_wall, machine, arm.number);
  for (int part = 0; part < heap_->parts(); ++part) {
    if (part == arm.held || truth_.parts[part].where == Whereabouts::in_bin) continue;
    const std::optional<double> depth = heap_->depth_mm(arm.held, part, kTouches_mm);
    if (depth && *depth > kTouches_mm) note(name(arm.held) + " in hand and " + name(part), *depth, machine, arm.number);
  }
}

void CellWorld::find_arm_contacts(MovingArm& arm, const controller_sim::Machine& machine) {
  const Pose arm_from_flange = base_from_arm(robot_, *arm.arm, waist_).inverse() * arm.base_from_tcp *
                               cell_.grippers[static_cast<std::size_t>(arm.tool)].flange_from_tcp.inverse();
  robot::ReachOptions options;
  options.from = arm.joints;
  options.form = machine.position(arm.number).type;  // as the command says
  const auto reached = reach(*arm.arm, arm_from_flange, options);
  if (!reached) return;  // a move of the joints does not follow the straight line that is taken here
  arm.joints = reached->joints;
  const std::vector<grasp::Convex> bin = picking::bodies_of(*cell_.bin);
  int link = 0;
  for (const grasp::Convex& body : grasp::arm_bodies(robot_, *arm.arm, waist_, *arm.joints)) {
    ++link;
    for (const grasp::Convex& side : bin)
      if (grasp::distance_mm(body, side, 1) <= 0)
        note("arm piece " + std::to_string(link) + " and the bin", 0, machine, arm.number);
  }
}

/// Links, gripper, and the box of what it holds.
std::vector<grasp::Convex> CellWorld::bodies_of_arm(const MovingArm& arm) const {
  std::vector<grasp::Convex> bodies;
  if (arm.joints) bodies = grasp::arm_bodies(robot_, *arm.arm, waist_, *arm.joints);
  const Tool& tool = tools_[arm.tool];
  for (const grasp::Convex& piece : grasp::pieces_at(tool.shape, tool.opening_mm))
    bodies.push_back(grasp::moved(arm.base_from_tcp, piece));
  if (arm.held >= 0) {
    Box box;
    for (const Vec3f& v : heap_->solid(arm.held).mesh().vertices) {
      const Vec3 p = v.cast<double>();
      box.min = box.min.cwiseMin(p), box.max = box.max.cwiseMax(p);
    }
    Pose middle = arm.base_from_tcp * arm.tcp_from_held;
    middle.translation() = middle * box.center();
    bodies.push_back(grasp::make_box(middle, box.size()));
  }
  return bodies;
}

void CellWorld::find_contacts_of_arms(const controller_sim::Machine& machine) {
  const std::vector<grasp::Convex> first = bodies_of_arm(arms_[0]), second = bodies_of_arm(arms_[1]);
  // Where both stand on the waist they meet without harm.
  for (std::size_t i = 1; i < first.size(); ++i)
    for (std::size_t k = 1; k < second.size(); ++k)
      if (grasp::distance_mm(first[i], second[k], 1) <= 0)
        note("piece " + std::to_string(i + 1) + " of arm 1 and piece " + std::to_string(k + 1) + " of arm 2", 0,
             machine, 1);
}

}  // namespace tribin::sim
