#include "tribin/picking/place.hpp"

#include <algorithm>

namespace tribin::picking {
namespace {

constexpr double kAbove_mm = 100;           // a part is lowered into its slot from there
constexpr double kClear_mm = 2;             // gripper and what stands in the rack: a robot's error, three times
constexpr double kPartClear_mm = 0.5;       // of parts: how close they stand is the rack's business
constexpr double kMostTurn = 10 * kDegree;  // of a tool that points up, from the level: nothing is placed from below

grasp::Convex box_of(const Part& part, const Pose& base_from_part) {
  Pose box = base_from_part;
  box.translation() = base_from_part * Vec3((part.box_min + part.box_max) / 2);
  return grasp::make_box(box, part.box_max - part.box_min);
}

grasp::Convex swept(grasp::Convex body, const Vec3& way) {
  body.sweep_mm = way;
  return body;
}

bool clear_of(const grasp::Convex& body, std::span<const grasp::Convex> others, double gap_mm) {
  return std::none_of(others.begin(), others.end(),
                      [&](const grasp::Convex& other) { return grasp::distance_mm(body, other, gap_mm) < gap_mm; });
}

Pose shifted(Pose pose, const Vec3& by) {
  pose.translation() += by;
  return pose;
}

bool is_clear(const Held& held, const std::array<Pose, 3>& tcp, const Pose& base_from_slot, const Pose& base_from_part,
              std::span<const grasp::Convex> standing) {
  const Vec3 up = base_from_slot.linear().col(2), down = tcp[0].translation() - tcp[1].translation(),
             back = tcp[2].translation() - tcp[1].translation();
  const double floor = up.dot(base_from_slot.translation());
  for (const grasp::Convex& piece : grasp::pieces_at(*held.gripper, held.opening_mm)) {
    const grasp::Convex at = grasp::moved(tcp[1], piece);
    for (const Vec3& way : {down, back}) {
      const grasp::Convex body = swept(at, way);
      if (-grasp::reach_along(body, -up) < floor + kClear_mm) return false;
      if (!clear_of(body, standing, kClear_mm)) return false;
    }
  }
  return clear_of(swept(box_of(*held.part, base_from_part), down), standing, kPartClear_mm);
}

}  // namespace

std::optional<std::vector<Stop>> stops_at(const ArmWithTool& arm, std::span<const Pose> base_from_tcp,
                                          const std::optional<robot::Joints>& from, bool one_form) {
  std::vector<Stop> stops;
  const Pose arm_from_base = base_from_arm(*arm.robot, *arm.arm).inverse(),
             tcp_from_flange = arm.flange_from_tcp.inverse();
  robot::ReachOptions options;
  options.from = from;
  options.limit_margin = arm.limit_margin_rad;
  options.singularity_margin = arm.singularity;
  for (const Pose& pose : base_from_tcp) {
    const Vec3 p = pose.translation();
    if (arm.workspace &&
        ((p.array() < arm.workspace->min.array()).any() || (p.array() > arm.workspace->max.array()).any()))
      return {};
    const auto reached = reach(*arm.arm, arm_from_base * pose * tcp_from_flange, options);
    if (!reached) return {};
    stops.push_back({pose, reached->joints});
    options.from = reached->joints;
    if (one_form) options.form = form_bits(*arm.arm, reached->joints);
  }
  return stops;
}

std::optional<Placing> plan_place(const ArmWithTool& arm, const Held& held, std::span<const Slot* const> slots,
                                  std::span<const Pose> slot_from_part, std::span<const Standing> standing,
                                  const std::function<bool(const Placing&)>& good) {
  std::vector<grasp::Convex> boxes;
  for (const Standing& other : standing) boxes.push_back(box_of(*other.part, other.base_from_part));
  const Pose part_from_tcp = held.tcp_from_part.inverse();
  for (const Slot* slot : slots)
    for (const Pose& stands : slot_from_part) {
      const Pose base_from_part = slot->base_from_slot * stands, at = base_from_part * part_from_tcp;
      const Vec3 up = slot->base_from_slot.linear().col(2), tool = at.linear().col(2);
      if (tool.dot(up) > std::sin(kMostTurn)) continue;
      const std::array<Pose, 3> tcp = {shifted(at, kAbove_mm * up), at, shifted(at, -kAbove_mm * tool)};
      if (!is_clear(held, tcp, slot->base_from_slot, base_from_part, boxes)) continue;
      const auto stops = stops_at(arm, tcp);
      if (!stops) continue;
      const Placing placing{slot, base_from_part, {(*stops)[0], (*stops)[1], (*stops)[2]}};
      if (!good || good(placing)) return placing;
    }
  return {};
}

std::vector<Pose> way_between(const Pose& from, const Pose& to, double travel_mm, std::span<const Pose> taught) {
  std::vector<Pose> way;
  if (!taught.empty()) {
    // From the end that is nearer: the same points lead to the rack and back.
    way.assign(taught.begin(), taught.end());
    const auto away = [&from](const Pose& pose) { return (pose.translation() - from.translation()).norm(); };
    if (away(way.back()) < away(way.front())) std::reverse(way.begin(), way.end());
    return way;
  }
  const auto raised = [travel_mm](Pose pose) {
    pose.translation().z() = std::max(pose.translation().z(), travel_mm);
    return pose;
  };
  constexpr double kThere_mm = 1;
  if (from.translation().z() < travel_mm - kThere_mm) way.push_back(raised(from));
  if (to.translation().z() < travel_mm - kThere_mm) way.push_back(raised(to));
  return way;
}

}  // namespace tribin::picking
