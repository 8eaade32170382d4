#include "sim/cell_world.hpp"

#include <algorithm>
#include <cmath>

#include "sim/grip.hpp"
#include "sim/solid.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"
#include "tribin/grasp/grasp.hpp"
#include "tribin/kinematics/inverse.hpp"
#include "tribin/picking/place.hpp"

namespace tribin::sim {
namespace {

constexpr double kStep = 1.0 / 240;  // s, of the physics
// The distance fields are right within half a cell of 1 mm: what lies deeper in another body touches it.
constexpr double kTouches_mm = 0.5;
constexpr double kHeldTouches_mm = 1;            // a part in the hand may have leant on a wall: the heap keeps 0.5 mm
constexpr double kLook_mm = 1, kArmLook_mm = 5;  // ways between looks for contacts
constexpr double kNearBin_mm = 60;               // above the rim: beyond, nothing in the bin can be touched
constexpr double kInSlot_mm = 25;                // a part let go farther from a slot's place falls
constexpr double kMoved_mm = 2;

/// A box or a cylinder as a mesh.
Mesh mesh_of(const grasp::Convex& body) {
  const bool round = body.disc_mm > 0;
  const double radius = body.disc_mm + body.radius_mm;
  const Vec3 half = body.half_mm + Vec3::Constant(body.radius_mm);
  const int corners = round ? 48 : 4;
  Mesh mesh;
  for (const double z : {-half.z(), half.z()})
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * kPi * i / corners;
      const Vec3 p = round ? Vec3(radius * std::cos(angle), radius * std::sin(angle), z)
                           : Vec3(i == 0 || i == 3 ? -half.x() : half.x(), i < 2 ? -half.y() : half.y(), z);
      mesh.vertices.push_back((body.frame_from_body * p).cast<float>());
    }
  const auto n = static_cast<std::uint32_t>(corners);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t k = (i + 1) % n;
    mesh.triangles.push_back({i, k, n + k});
    mesh.triangles.push_back({i, n + k, n + i});
    if (i == 0 || k == 0) continue;
    mesh.triangles.push_back({0, k, i});
    mesh.triangles.push_back({n, n + i, n + k});
  }
  return mesh;
}

Vec3 inner_size(const WorkCell& cell) { return cell.bin->inner_size_mm; }

Bin bin_of(const WorkCell& cell) {
  const Vec3 size = inner_size(cell);
  return {size.x(), size.y(), size.z(), cell.bin->wall_mm};
}

}  // namespace

CellWorld::CellWorld(const WorkCell& cell, const robot::RobotModel& robot, const CellStock& stock,
                     const SimulatedCellOptions& options)
    : cell_(cell),
      robot_(robot),
      arm_(cell.robots.front().arm.empty() ? robot.arms.front() : arm_called(robot, cell.robots.front().arm)),
      stock_(stock),
      options_(options),
      random_(mixed(options.seed) ^ 0xCE11u),
      field_(options.robot_mm, options.seed),
      base_from_bin_(cell.bin->base_from_bin) {
  base_from_camera_ =
      cell.hand_eye.parent_from_camera * drawn_motion(options.hand_eye_mm, options.hand_eye_rad, random_);
  if (cell.rack) slots_ = picking::slots_of(*cell.rack);
  drop_parts(options);
  add_tools(cell);
}

void CellWorld::drop_parts(const SimulatedCellOptions& options) {
  const Bin bin = bin_of(cell_);
  const int classes = static_cast<int>(stock_.solids.size());
  for (int i = 0; i < options.parts; ++i) class_of_.push_back(i % classes);
  for (int i = options.parts - 1; i > 0; --i) std::swap(class_of_[i], class_of_[random_.integer(0, i)]);
  const int leaning = options.at_walls ? std::max(1, options.parts / 4) : 0;
  std::vector<const Solid*> solids;
  BinFill fill;
  for (std::uint64_t attempt = 0;; ++attempt) {
    solids.clear();
    for (const int k : class_of_) solids.push_back(&stock_.solids[k]);
    const std::vector<const Solid*> dropped(solids.begin(), solids.end() - std::min<int>(leaning, class_of_.size()));
    fill = fill_bin(dropped, bin.length_mm, bin.width_mm, mixed(options.seed) + attempt);
    // A heap that leans over the rim would fall out: another one, then a smaller one.
    if (fill.wall_contact_mm <= bin.height_mm) break;
    if (attempt % 3 == 2) class_of_.pop_back();
    if (class_of_.empty())
      throw Error(ErrorCode::out_of_range, cell_.file.string() + ": no part fits into the bin; wanted a larger one");
  }
  const int first_leaning = static_cast<int>(fill.bin_from_part.size());
  for (int i = first_leaning; i < static_cast<int>(solids.size()); ++i)
    fill.bin_from_part.push_back(upright_at_wall(*solids[i], i - first_leaning, fill.top_mm));
  heap_ = std::make_unique<LiveHeap>(bin, solids, fill.bin_from_part);
  constexpr int kLongest = 5 * 240;  // steps until the next one comes, however it rolls
  for (int i = first_leaning; i < static_cast<int>(solids.size()); ++i) {
    heap_->let_go(i);
    for (int step = 0; step < kLongest && !heap_->at_rest(); ++step) heap_->step();
  }
  for (const int k : class_of_) {
    PartTruth part;
    part.part = cell_.parts[k].name;
    truth_.parts.push_back(part);
  }
  note_scan();
  truth_.disturbed = 0;
}

/// A part on end beside a wall, every second one in a corner, a little tilted towards it: it leans there when it is let
/// go. \param above_mm  what lies below it
Pose CellWorld::upright_at_wall(const Solid& solid, int number, double above_mm) {
  constexpr double kGap_mm = 4;
  const Vec3 half(inner_size(cell_).x() / 2, inner_size(cell_).y() / 2, 0);
  const int wall = random_.integer(0, 3);
  const Vec3 to_wall = wall == 0   ? Vec3(1, 0, 0)
                       : wall == 1 ? Vec3(-1, 0, 0)
                       : wall == 2 ? Vec3(0, 1, 0)
                                   : Vec3(0, -1, 0);
  Pose pose = Pose::Identity();
  const double tilt = random_.uniform(2, 8) * kDegree;
  pose.linear() = rotation_from_vector(tilt * Vec3::UnitZ().cross(to_wall)) *
                  rotation_from_vector(Vec3(0, 0, random_.uniform(0, 2 * kPi))) *
                  rotation_from_vector(Vec3(random_.integer(0, 1) * kPi, 0, 0));
  Box box;
  for (const Vec3f& v : solid.mesh().vertices) {
    const Vec3 p = pose.linear() * v.cast<double>();
    box.min = box.min.cwiseMin(p), box.max = box.max.cwiseMax(p);
  }
  const Vec3 room = (half - box.size() / 2).cwiseMax(0.0) - Vec3(kGap_mm, kGap_mm, 0);
  Vec3 middle(random_.uniform(-room.x(), room.x()), random_.uniform(-room.y(), room.y()), 0);
  for (int k = 0; k < 2; ++k)
    if (to_wall[k] != 0)
      middle[k] = to_wall[k] * room[k];
    else if (number % 2 == 0)
      middle[k] = (middle[k] < 0 ? -1 : 1) * room[k];
  middle.z() = above_mm + box.size().z() / 2 + number * (box.size().z() + kGap_mm);
  pose.translation() = middle - box.center();
  return pose;
}

void CellWorld::add_tools(const WorkCell& cell) {
  tools_.resize(cell.grippers.size());
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    Tool& tool = tools_[i];
    tool.shape = grasp::gripper_shape(cell.grippers[i]);
    for (const grasp::GripperPiece& piece : tool.shape.pieces) tool.meshes.push_back(mesh_of(piece.body));
    for (const Mesh& mesh : tool.meshes) tool.solids.emplace_back(mesh);
    for (const Solid& solid : tool.solids) tool.bodies.push_back(heap_->add_tool(solid));
    tool.opening_mm = tool.shape.jaws > 0 ? tool.shape.stroke_max() : 0;
  }
}

Pose CellWorld::true_tcp(const controller_sim::Machine& machine) const {
  Pose pose = robot::pose_of(machine.position());
  pose.translation() += field_.error_at(pose.translation());
  return pose;
}

CellWorld::Tool& CellWorld::tool_of(const controller_sim::Machine& machine) {
  const int number = std::clamp(machine.position().tool - 1, 0, static_cast<int>(tools_.size()) - 1);
  if (number != active_ && active_ >= 0) {  // the other gripper is put away
    Pose away = Pose::Identity();
    away.translation() = Vec3::Constant(1e5);
    for (const int body : tools_[active_].bodies) heap_->move(body, away);
  }
  active_ = number;
  return tools_[number];
}

void CellWorld::place_bodies(Tool& tool) {
  const Pose bin_from_tcp = base_from_bin_.inverse() * base_from_tcp_;
  for (std::size_t i = 0; i < tool.bodies.size(); ++i) {
    Pose piece = bin_from_tcp;
    piece.translation() += bin_from_tcp.linear() * (tool.opening_mm * tool.shape.pieces[i].travel);
    heap_->move(tool.bodies[i], piece);
  }
  if (held_ >= 0) heap_->move(held_, bin_from_tcp * tcp_from_held_);
}

/// A command says how far the jaws are to be open: I003, in tenths of a millimetre; 0 = as far as they go.
void CellWorld::set_opening(Tool& tool, const controller_sim::Machine& machine) {
  if (tool.shape.jaws == 0) return;
  const auto said = machine.integers.find(3);
  const double low = tool.shape.stroke_min(), high = tool.shape.stroke_max();
  const double wanted = said == machine.integers.end() ? 0 : said->second / 10.0;
  tool.opening_mm = wanted > 0 ? std::clamp(wanted, low, high) : tool.shape.inside ? low : high;
}

void CellWorld::follow(const controller_sim::Machine& machine) {
  Tool& tool = tool_of(machine);
  const auto taken = machine.integers.find(1);
  const int cycle = taken == machine.integers.end() ? 0 : taken->second;
  if (cycle != cycle_) {
    cycle_ = cycle;
    const auto command = machine.bytes.find(0);
    const bool picks = command != machine.bytes.end() && command->second == 1;
    if (held_ < 0 && (picks || in_push(machine))) set_opening(tool, machine);
  }
  base_from_tcp_ = true_tcp(machine);
  truth_.simulated_s = machine.now_s();
  place_bodies(tool);
  for (; physics_s_ + kStep <= machine.now_s(); physics_s_ += kStep) {
    if (heap_->at_rest()) {
      heap_->step();  // wakes what is touched
      if (heap_->at_rest()) {
        physics_s_ += std::floor((machine.now_s() - physics_s_) / kStep) * kStep;
        break;
      }
    } else {
      heap_->step();
    }
  }
  const Vec3 here = base_from_tcp_.translation();
  if ((here - looked_at_).norm() >= kLook_mm) {
    looked_at_ = here;
    find_contacts(tool, machine);
  }
  if ((here - arm_looked_at_).norm() >= kArmLook_mm) {
    arm_looked_at_ = here;
    find_arm_contacts(active_, machine);
  }
}

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
  constexpr int kForm = 7;  // flip, elbow and back, as the command says
  options.form = machine.position().type & kForm;
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

bool CellWorld::close(const controller_sim::Machine& machine) {
  follow(machine);
  Tool& tool = tool_of(machine);
  ++truth_.grips;
  const Pose tcp_from_bin = (base_from_bin_.inverse() * base_from_tcp_).inverse();
  std::string why = "nothing is there";
  int touched = 0;
  for (int part = 0; part < heap_->parts(); ++part) {
    const Pose tcp_from_part = tcp_from_bin * heap_->pose(part);
    const CellPart& of = cell_.parts[class_of_[part]];
    if (tcp_from_part.translation().norm() > 2 * heap_->solid(part).diameter_mm() + tool.shape.stroke_max()) continue;
    const Grip grip = close_gripper(tool.shape, tool.opening_mm, heap_->solid(part), tcp_from_part,
                                    tool.shape.gripper.friction, of.mass_kg);
    touched += grip.touches;
    if (!grip.why.empty() && grip.touches) why = of.name + ": " + grip.why;
    if (!grip.holds || held_ >= 0) continue;
    held_ = part;
    const Pose slip = drawn_motion(options_.slip_mm, options_.slip_rad, random_);
    tcp_from_held_ = grip.motion * tcp_from_part;
    tcp_from_held_.linear() = slip.linear() * tcp_from_held_.linear();
    tcp_from_held_.translation() += slip.translation();
    tool.opening_mm = grip.opening_mm;
  }
  if (held_ >= 0 && touched > 1) {
    held_ = -1;
    why = "two parts are between the jaws";
  }
  if (held_ < 0) {
    truth_.failed_grips.push_back(why);
    return false;
  }
  heap_->hold(held_);
  truth_.parts[held_].where = Whereabouts::in_hand;
  place_bodies(tool);
  return true;
}

void CellWorld::note_placed(int part, int slot, const Pose& base_from_wanted) {
  PartTruth& truth = truth_.parts[part];
  const Pose here = base_from_bin_ * heap_->pose(part);
  truth.slot = slot;
  truth.off_mm = (here.translation() - base_from_wanted.translation()).norm();
  truth.off_rad = rotation_angle(here.linear(), base_from_wanted.linear());
}

void CellWorld::open(const controller_sim::Machine& machine) {
  follow(machine);
  Tool& tool = tool_of(machine);
  const int part = std::exchange(held_, -1);
  set_opening(tool, machine);
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
  const Vec3 in_bin = heap_->pose(part).translation(), size = inner_size(cell_);
  if (std::abs(in_bin.x()) < size.x() / 2 && std::abs(in_bin.y()) < size.y() / 2) {
    truth.where = Whereabouts::in_bin;
    heap_->let_go(part);
  } else {
    truth.where = Whereabouts::lost;
    heap_->stand(part);
  }
}

bool CellWorld::reachable(const Pose& base_from_tcp, int tool) const {
  const auto number = static_cast<std::size_t>(std::clamp(tool - 1, 0, static_cast<int>(tools_.size()) - 1));
  return reach(arm_,
               base_from_arm(robot_, arm_).inverse() * base_from_tcp * cell_.grippers[number].flange_from_tcp.inverse())
      .has_value();
}

const CellTruth& CellWorld::truth() {
  for (int i = 0; i < heap_->parts(); ++i) truth_.parts[i].base_from_part = base_from_bin_ * heap_->pose(i);
  return truth_;
}

std::vector<CellWorld::Standing> CellWorld::standing() const {
  std::vector<Standing> out;
  for (int i = 0; i < heap_->parts(); ++i)
    if (i != held_) out.push_back({class_of_[i], base_from_bin_ * heap_->pose(i)});
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
