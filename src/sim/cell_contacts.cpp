// What touches what it must not: gripper, part in the hand and arm against bin and parts.
#include "sim/cell_world.hpp"
#include "tribin/grasp/grasp.hpp"
#include "tribin/kinematics/inverse.hpp"
#include "tribin/picking/place.hpp"

namespace tribin::sim {
namespace {

// The distance fields are right within half a cell of 1 mm: what lies deeper in another body touches it.
constexpr double kTouches_mm = 0.5;
constexpr double kHeldTouches_mm = 1;  // a part in the hand may have leant on a wall: the heap keeps 0.5 mm

}  // namespace

void CellWorld::note(const std::string& what, double depth_mm, const controller_sim::Machine& machine) {
  if (noted_.insert({cycle_, what}).second) truth_.collisions.push_back({machine.now_s(), cycle_, what, depth_mm});
}

bool CellWorld::in_push(const controller_sim::Machine& machine) const {
  const auto of_class = machine.bytes.find(2);
  return of_class != machine.bytes.end() && of_class->second == kPushClass;
}

void CellWorld::find_contacts(const Tool& tool, const controller_sim::Machine& machine) {
  const auto name = [&](int part) { return truth_.parts[part].part + " " + std::to_string(part + 1); };
  for (std::size_t i = 0; i < tool.bodies.size(); ++i) {
    const std::string piece = tool.shape.gripper.name + " piece " + std::to_string(i + 1);
    const double in_wall = heap_->depth_in_walls_mm(tool.bodies[i]);
    if (in_wall > kTouches_mm) note(piece + " and the bin", in_wall, machine);
    const bool jaw = tool.shape.pieces[i].jaw;
    if (jaw && in_push(machine)) continue;
    const double allowed = jaw && tool.shape.jaws == 0 ? 3 : kTouches_mm;  // a cup's lip gives way
    for (int part = 0; part < heap_->parts(); ++part) {
      if (part == held_) continue;
      const std::optional<double> depth = heap_->depth_mm(tool.bodies[i], part, kTouches_mm);
      if (depth && *depth > allowed) note(piece + " and " + name(part), *depth, machine);
    }
  }
  if (held_ < 0) return;
  const double in_wall = heap_->depth_in_walls_mm(held_);
  if (in_wall > kHeldTouches_mm) note(name(held_) + " in hand and the bin", in_wall, machine);
  for (int part = 0; part < heap_->parts(); ++part) {
    if (part == held_ || truth_.parts[part].where == Whereabouts::in_bin) continue;
    const std::optional<double> depth = heap_->depth_mm(held_, part, kTouches_mm);
    if (depth && *depth > kTouches_mm) note(name(held_) + " in hand and " + name(part), *depth, machine);
  }
}

void CellWorld::find_arm_contacts(int tool, const controller_sim::Machine& machine) {
  const Pose arm_from_flange = base_from_arm(robot_, arm_).inverse() * base_from_tcp_ *
                               cell_.grippers[static_cast<std::size_t>(tool)].flange_from_tcp.inverse();
  robot::ReachOptions options;
  options.from = joints_;
  options.form = machine.position().type;  // as the command says
  const auto reached = reach(arm_, arm_from_flange, options);
  if (!reached) return;  // a move of the joints does not follow the straight line that is taken here
  joints_ = reached->joints;
  const std::vector<grasp::Convex> bin = picking::bodies_of(*cell_.bin);
  int link = 0;
  for (const grasp::Convex& body : grasp::arm_bodies(robot_, arm_, 0, *joints_)) {
    ++link;
    for (const grasp::Convex& side : bin)
      if (grasp::distance_mm(body, side, 1) <= 0)
        note("arm piece " + std::to_string(link) + " and the bin", 0, machine);
  }
}

}  // namespace tribin::sim
