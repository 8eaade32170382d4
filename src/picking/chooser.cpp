#include "picking/chooser.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/error.hpp"

namespace tribin::picking {
namespace {

constexpr double kFirstTilt = 30 * kDegree;  // of an approach, before anything steeper is tried
// Grasps of a part that are looked at for a way into a slot; more before it goes to the station.
constexpr int kMostPerPart = 12, kMostDirect = 40;
constexpr double kSamePart_mm = 20;   // a part that was missed lies that near to where it was
constexpr double kTravelGap_mm = 20;  // over all that stands

/// What software refuses of a motion, whatever the controller does.
bool of_motion(robot::RefusalCode code) { return code >= robot::RefusalCode::not_finite; }

}  // namespace

Chooser::Chooser(const WorkCell& cell, const robot::RobotModel& robot, Vision& vision,
                 const robot::SafetyLimits& limits, std::size_t number)
    : cell_(cell), robot_(robot), vision_(vision), limits_(limits), number_(number) {
  const auto want = [&cell](bool there, const char* what) {
    if (!there)
      throw Error(ErrorCode::bad_input, cell.file.string() + ": saw no " + what + ", wanted one to pick and place");
  };
  want(cell.rack.has_value(), "[rack]");
  want(!cell.grippers.empty(), "[[gripper]]");
  want(!cell.parts.empty(), "[[part]]");
  want(!cell.robots.empty(), "[[robot]]");
  want(cell.safety.workspace_mm.has_value(), "safety.workspace_mm");
  want(cell.mount() == CameraMount::fixed || !cell.camera->looks.empty(), "camera.looks");
  slots_ = slots_of(*cell.rack);
  for (const Gripper& gripper : cell.grippers) shapes_.push_back(grasp::gripper_shape(gripper));
}

const CellPart& Chooser::cell_part(const std::string& name) const {
  for (const CellPart& part : cell_.parts)
    if (part.name == name) return part;
  throw Error(ErrorCode::bad_input, cell_.file.string() + ": saw no [[part]] called " + name + ", wanted one");
}

int Chooser::tool_of(const std::string& gripper) const {
  for (std::size_t i = 0; i < cell_.grippers.size(); ++i)
    if (cell_.grippers[i].name == gripper) return static_cast<int>(i) + 1;
  throw Error(ErrorCode::bad_input, cell_.file.string() + ": saw no [[gripper]] called " + gripper + ", wanted one");
}

const grasp::GripperShape& Chooser::shape(const std::string& gripper) const {
  return shapes_[static_cast<std::size_t>(tool_of(gripper)) - 1];
}

std::vector<std::string> Chooser::own_grippers() const {
  if (!cell_.robots[number_].grippers.empty()) return cell_.robots[number_].grippers;
  std::vector<std::string> names;
  for (const Gripper& gripper : cell_.grippers) names.push_back(gripper.name);
  return names;
}

void Chooser::stand_among(double waist, std::vector<grasp::Convex> others) {
  waist_ = waist;
  others_ = std::move(others);
}

Pose Chooser::wait() const {
  if (!waits()) return Pose::Identity();
  const robot::Arm& arm = arm_of(cell_, robot_, number_);
  return base_from_arm(robot_, arm, waist_) * base_from_arm(robot_, arm).inverse() * *cell_.robots[number_].wait;
}

ArmWithTool Chooser::arm_with(const std::string& gripper, const Entry* held) const {
  ArmWithTool arm;
  arm.robot = &robot_;
  arm.arm = &arm_of(cell_, robot_, number_);
  arm.waist = waist_;
  if (waits()) {
    arm.others = others_;
    for (const grasp::Convex& piece : grasp::pieces_at(shape(gripper), shape(gripper).stroke_max()))
      arm.on_tcp.push_back(piece);
    if (held) arm.on_tcp.push_back(box_of(vision_.model(held->part), held->tcp_from_part));
  }
  arm.flange_from_tcp = shape(gripper).gripper.flange_from_tcp;
  arm.workspace = cell_.safety.workspace_mm;
  arm.limit_margin_rad = limits_.limit_margin_rad;
  arm.singularity = limits_.singularity;
  return arm;
}

Places Chooser::places(const Filling& filling) const {
  Places out;
  for (const CellPart& part : cell_.parts) {
    std::vector<Pose> poses;
    for (const Slot* slot : open_slots(slots_, filling, cell_.rack->when_missing)) {
      if (!may_stand(*slot, part.name)) continue;
      for (const Pose& pose : alike(vision_.model(part.name), slot->base_from_slot * part.slot_from_part))
        poses.push_back(pose);
    }
    if (poses.empty()) continue;  // no slot waits for it
    for (const Pose& stands : station_poses(cell_, part))
      for (const Pose& pose : alike(vision_.model(part.name), stands)) poses.push_back(pose);
    out[part.name] = std::move(poses);
  }
  return out;
}

grasp::PlanOptions Chooser::plan_options(Resort resort, std::vector<grasp::FailedPick> failed, bool closely) const {
  grasp::PlanOptions options;
  options.limit_margin_rad = limits_.limit_margin_rad;
  options.singularity = limits_.singularity;
  options.min_score = limits_.min_score;
  options.most_per_part = closely ? kMostDirect : kMostPerPart;
  options.failed = std::move(failed);
  if (resort < Resort::full_tilt) options.max_tilt_rad = kFirstTilt;
  if (!cell_.robots[number_].grippers.empty() && resort != Resort::none) options.grippers = own_grippers();
  if (resort == Resort::none)
    for (const CellPart& part : cell_.parts) {
      const std::vector<std::string> own = own_grippers(), &all = part.grippers.empty() ? own : part.grippers;
      const auto mine = std::find_if(all.begin(), all.end(), [&](const std::string& name) {
        return std::find(own.begin(), own.end(), name) != own.end();
      });
      if (mine == all.end()) continue;
      const std::string& first = *mine;
      if (std::find(options.grippers.begin(), options.grippers.end(), first) == options.grippers.end())
        options.grippers.push_back(first);
    }
  return options;
}

std::optional<std::vector<Stop>> Chooser::way(const Start& start, const Pose& base_from_tcp, const std::string& gripper,
                                              const Entry* held) const {
  auto stops = whole_way(start, base_from_tcp, gripper, held);
  if (stops) stops->pop_back();
  return stops;
}

std::optional<std::vector<Stop>> Chooser::whole_way(const Start& start, const Pose& base_from_tcp,
                                                    const std::string& gripper, const Entry* held) const {
  ArmWithTool arm = arm_with(gripper, held);
  arm.singularity = 0;  // these are moves of the joints
  const Pose from = start.base_from_flange * arm.flange_from_tcp;
  const Vec3 bin = cell_.bin ? cell_.bin->base_from_bin.translation() : base_from_tcp.translation();
  std::vector<Pose> poses = way_between(from, base_from_tcp, travel_mm(), cell_.robots[number_].way_points, bin);
  poses.push_back(base_from_tcp);  // the last piece leads there
  auto stops = stops_at(arm, poses, start.joints, false);
  if (!stops) return {};
  if (cell_.bin) {
    // Where the arm begins is not known at the very start: then its first stop is taken for it.
    const Stop begin = start.joints ? Stop{from, *start.joints} : stops->front();
    if (!arm_is_clear(arm, begin, *stops, bodies_of(*cell_.bin))) return {};
  }
  return stops;
}

std::string Chooser::scan_against(const Slot& slot, const CellPart& part) const {
  if (!cell_.rack->check_by_scan) return {};
  const Part& model = vision_.model(part.name);
  Pose middle = slot.base_from_slot * part.slot_from_part;
  middle.translation() = middle * model.box_center();
  switch (vision_.room(middle, model.box_max - model.box_min)) {
    case RoomSeen::empty:
      return {};
    case RoomSeen::occupied:
      return std::string(robot::name_of(robot::RefusalCode::slot_occupied)) + ": the scan shows something in " +
             name_of(slot) + ", wanted it empty";
    default:
      return std::string(robot::name_of(robot::RefusalCode::slot_occupied)) + ": the scan does not show all of " +
             name_of(slot) + ", wanted it seen empty";
  }
}

std::optional<Placing> Chooser::place(const Entry& held, const Filling& filling, const Start& start,
                                      Where where) const {
  const CellPart& part = cell_part(held.part);
  std::vector<const Slot*> open;
  std::vector<Pose> stands;
  Slot station;
  const auto tight = [&](const Slot& slot) {
    PlaceError error;
    error.pose = held.sigma_mm, error.robot = cell_.robots.front().sigma_mm;
    return held.sigma_mm > 0 && too_tight(slot, error, cell_.rack->chamfer_mm);
  };
  if (where == Where::slots) {
    for (const Slot* slot : open_slots(slots_, filling, cell_.rack->when_missing))
      if (may_stand(*slot, held.part) && scan_against(*slot, part).empty() && !tight(*slot)) open.push_back(slot);
    stands = alike(vision_.model(held.part), part.slot_from_part);
  } else if (has_station()) {
    station.base_from_slot = cell_.regrasp->base_from_station;
    open.push_back(&station);
    for (const Pose& pose : where == Where::station ? std::vector<Pose>{part.slot_from_part} : part.station_from_part)
      for (const Pose& same : alike(vision_.model(held.part), pose)) stands.push_back(same);
  }
  const Held in_hand{&vision_.model(held.part), &shape(held.gripper), held.opening_mm, held.tcp_from_part};
  const Pose flange_from_tcp = shape(held.gripper).gripper.flange_from_tcp;
  const auto has_ways = [&](const Placing& p) {
    if (!way(start, p.stops[0].base_from_tcp, held.gripper, &held)) return false;
    if (!cell_.bin) return true;
    if (!arm_is_clear(arm_with(held.gripper, &held), p.stops[0], std::span(p.stops).subspan(1), bodies_of(*cell_.bin)))
      return false;
    const Start after{p.stops[2].base_from_tcp * flange_from_tcp.inverse(), p.stops[2].joints};
    return way(after, next_place(held.gripper, after), held.gripper).has_value();
  };
  auto placing = plan_place(arm_with(held.gripper), in_hand, open, stands, standing(filling), has_ways);
  if (placing && placing->slot == &station) placing->slot = nullptr;
  return placing;
}

std::vector<Standing> Chooser::standing(const Filling& filling) const {
  std::vector<Standing> out;
  for (std::size_t i = 0; i < filling.size(); ++i)
    if (!filling[i].empty())
      out.push_back({&vision_.model(filling[i]), slots_[i].base_from_slot * cell_part(filling[i]).slot_from_part});
  return out;
}

std::optional<Placing> Chooser::place_after(const grasp::Grasp& grasp, const Filling& filling,
                                            const std::optional<Start>& start, Where where) const {
  if (start && !way(*start, grasp.path.front().base_from_tcp, grasp.gripper)) return {};
  Entry held;
  held.part = grasp.part_name, held.gripper = grasp.gripper, held.opening_mm = grasp.opening_before_mm;
  held.tcp_from_part = grasp.part_from_tcp.inverse();
  const grasp::PathPoint& retreat = grasp.path.back();
  Start carried{retreat.base_from_tcp * shape(grasp.gripper).gripper.flange_from_tcp.inverse(), retreat.joints};
  if (waits()) {
    const auto back = whole_way(carried, next_place(grasp.gripper, carried), grasp.gripper, &held);
    if (!back) return {};
    carried = {back->back().base_from_tcp * shape(grasp.gripper).gripper.flange_from_tcp.inverse(),
               back->back().joints};
  }
  if (cell_.in_hand)
    if (const auto shown = way_to_show(carried, cell_.in_hand->looks.back(), held, filling))
      carried = {cell_.in_hand->looks.back(), shown->back().joints};
  return place(held, filling, carried, where);
}

std::optional<Choice> Chooser::choose(const grasp::Plan& plan, const Filling& filling,
                                      const std::optional<Start>& start, std::span<const Where> wheres,
                                      std::span<const Avoid> avoid, std::vector<std::string>& why) const {
  int no_way = 0, no_place = 0;
  for (const Where where : wheres) {
    for (const grasp::Grasp& grasp : plan.grasps) {
      const Vec3 at = vision_.part(grasp.part).base_from_part.translation();
      const auto is_there = [&](const Avoid& place) {
        return place.gripper == grasp.gripper && (place.part_at - at).norm() < kSamePart_mm;
      };
      if (std::any_of(avoid.begin(), avoid.end(), is_there)) continue;
      if (start && !way(*start, grasp.path.front().base_from_tcp, grasp.gripper)) {
        ++no_way;
        continue;
      }
      auto placing = place_after(grasp, filling, {}, where);
      if (!placing) {
        ++no_place;
        continue;
      }
      Choice choice{grasp, vision_.part(grasp.part), std::move(*placing)};
      const std::vector<robot::Refusal> refusals = refusals_of(choice, 0);
      if (refusals.empty()) return choice;
      for (const robot::Refusal& refusal : refusals)
        if (std::find(why.begin(), why.end(), refusal.message) == why.end()) why.push_back(refusal.message);
    }
  }
  for (const Slot* slot : open_slots(slots_, filling, cell_.rack->when_missing))
    for (const CellPart& part : cell_.parts) {
      if (no_place == 0 || !may_stand(*slot, part.name)) continue;
      const std::string against = scan_against(*slot, part);
      if (!against.empty() && std::find(why.begin(), why.end(), against) == why.end()) why.push_back(against);
    }
  if (no_way > 0) why.push_back(std::to_string(no_way) + " times no way to the grasp from where the arm stands");
  if (no_place > 0) why.push_back(std::to_string(no_place) + " times no way for its part into a slot");
  return {};
}

std::vector<robot::Refusal> Chooser::refusals_of(const Choice& choice, double scan_age_s) const {
  robot::CommandFacts facts;
  facts.kind = robot::CommandKind::motion;
  robot::MotionFacts& motion = facts.motion;
  for (const grasp::PathPoint& point : choice.grasp.path) motion.base_from_tcp.push_back(point.base_from_tcp);
  for (const Stop& stop : choice.placing.stops) motion.base_from_tcp.push_back(stop.base_from_tcp);
  motion.tool = tool_of(choice.grasp.gripper);
  motion.scan = robot::ScanFacts{scan_age_s, 0, 0, false, choice.part.score, choice.part.visible};
  const bool known = !cell_.hand_eye.parent_from_camera.isApprox(Pose::Identity());
  if (known) motion.hand_eye = robot::HandEyeFacts{0, cell_.hand_eye.sigma_mm};
  if (choice.placing.slot) {
    motion.slot = robot::SlotFacts{false, may_stand(*choice.placing.slot, choice.grasp.part_name)};
    // A slot that is too tight is never right.
    if (const auto tight = too_tight(*choice.placing.slot, error_of(choice), cell_.rack->chamfer_mm))
      return {{robot::RefusalCode::slot_class, *tight}};
  }
  std::vector<robot::Refusal> out;
  for (robot::Refusal& refusal : robot::refusals(facts, limits_))
    if (of_motion(refusal.code)) out.push_back(std::move(refusal));
  return out;
}

Pose Chooser::next_place(const std::string& gripper, const Start& from) const {
  if (!waits()) return over_bin();
  Pose flange = wait();
  const Matrix3 turn = flange.linear().transpose() * from.base_from_flange.linear();
  const double angle = std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
  flange.linear() = flange.linear() * rotation_from_vector(Vec3(0, 0, angle));
  return flange * shape(gripper).gripper.flange_from_tcp;
}

Pose Chooser::over_bin() const {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0));  // the tool looks down
  if (cell_.bin) pose.translation() = cell_.bin->base_from_bin.translation();
  pose.translation().z() = travel_mm();
  return pose;
}

double Chooser::travel_mm() const {
  double top = -1e300, below = 0;
  for (const CellPart& part : cell_.parts) below = std::max(below, vision_.model(part.name).diameter_mm);
  for (const Slot& slot : slots_) top = std::max(top, slot.base_from_slot.translation().z() + below);
  if (has_station()) top = std::max(top, cell_.regrasp->base_from_station.translation().z() + below);
  if (cell_.bin)
    for (int i = 0; i < 4; ++i) {
      const Vec3 half = cell_.bin->inner_size_mm / 2;
      const Vec3 corner(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(), cell_.bin->inner_size_mm.z());
      top = std::max(top, (cell_.bin->base_from_bin * corner).z());
    }
  return std::min(top + below + kTravelGap_mm, cell_.safety.workspace_mm->max.z());
}

}  // namespace tribin::picking
