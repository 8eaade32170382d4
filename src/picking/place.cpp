#include "tribin/picking/place.hpp"

#include <algorithm>

namespace tribin::picking {
namespace {

constexpr double kAbove_mm = 100;           // a part is lowered into its slot from there, the tool goes back at least
constexpr double kClear_mm = 2;             // gripper and what stands in the rack: a robot's error, three times
constexpr double kArmsClear_mm = 30;        // between two arms: half of the way between looks at them
constexpr double kPartClear_mm = 0.5;       // of parts: how close they stand is the rack's business
constexpr double kMostTurn = 10 * kDegree;  // of a tool that points up, from the level: nothing is placed from below

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

/// How far a tool goes back along itself until it stands before all of the part that it let go: what it does then, a
/// turn or another tool, cannot touch it.
double way_back_mm(const Held& held, const Pose& base_from_tcp, const Pose& base_from_part) {
  const Vec3 tool = base_from_tcp.linear().col(2);
  double tips = -1e300;
  for (const grasp::Convex& piece : grasp::pieces_at(*held.gripper, held.opening_mm))
    tips = std::max(tips, grasp::reach_along(grasp::moved(base_from_tcp, piece), tool));
  const double front = -grasp::reach_along(box_of(*held.part, base_from_part), -tool);
  return std::max(kAbove_mm, tips - front + kClear_mm);
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

grasp::Convex box_of(const Part& part, const Pose& frame_from_part) {
  Pose box = frame_from_part;
  box.translation() = frame_from_part * Vec3((part.box_min + part.box_max) / 2);
  return grasp::make_box(box, part.box_max - part.box_min);
}

std::optional<std::vector<Stop>> stops_at(const ArmWithTool& arm, std::span<const Pose> base_from_tcp,
                                          const std::optional<robot::Joints>& from, bool one_form) {
  std::vector<Stop> stops;
  const Pose arm_from_base = base_from_arm(*arm.robot, *arm.arm, arm.waist).inverse(),
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
      const std::array<Pose, 3> tcp = {shifted(at, kAbove_mm * up), at,
                                       shifted(at, -way_back_mm(held, at, base_from_part) * tool)};
      if (!is_clear(held, tcp, slot->base_from_slot, base_from_part, boxes)) continue;
      const auto stops = stops_at(arm, tcp);
      if (!stops) continue;
      const Placing placing{slot, base_from_part, {(*stops)[0], (*stops)[1], (*stops)[2]}};
      if (!good || good(placing)) return placing;
    }
  return {};
}

std::vector<Pose> way_between(const Pose& from, const Pose& to, double travel_mm, std::span<const Pose> taught,
                              const Vec3& keep_still) {
  std::vector<Pose> way;
  const auto away = [](const Pose& pose, const Vec3& point) { return (pose.translation() - point).norm(); };
  if (!taught.empty()) {
    // From the end that is nearer: the same points lead to the rack and back.
    way.assign(taught.begin(), taught.end());
    if (away(way.back(), from.translation()) < away(way.front(), from.translation()))
      std::reverse(way.begin(), way.end());
    return way;
  }
  const auto raised = [travel_mm](Pose pose) {
    pose.translation().z() = std::max(pose.translation().z(), travel_mm);
    return pose;
  };
  constexpr double kThere_mm = 1;
  const Pose above_from = raised(from), above_to = raised(to);
  if (from.translation().z() < travel_mm - kThere_mm) way.push_back(above_from);
  const bool turn_at_start = away(from, keep_still) > away(to, keep_still);
  Pose turned = turn_at_start ? above_from : above_to;
  turned.linear() = turn_at_start ? to.linear() : from.linear();
  if (rotation_angle(from.linear(), to.linear()) > kDegree) way.push_back(turned);
  if (to.translation().z() < travel_mm - kThere_mm) way.push_back(above_to);
  return way;
}

namespace {

/// An arm and what it carries, at one place of a way.
struct ArmBodies {
  std::vector<grasp::Convex> links, carried;
};

ArmBodies pieces_of(const ArmWithTool& arm, const robot::Joints& joints) {
  ArmBodies bodies{grasp::arm_bodies(*arm.robot, *arm.arm, arm.waist, joints), {}};
  if (arm.on_tcp.empty()) return bodies;
  const Pose tcp =
      base_from_arm(*arm.robot, *arm.arm, arm.waist) * arm_from_flange(*arm.arm, joints) * arm.flange_from_tcp;
  for (const grasp::Convex& piece : arm.on_tcp) bodies.carried.push_back(grasp::moved(tcp, piece));
  return bodies;
}

/// Without the pieces that stand still: both arms of a robot have the same body.
std::span<const grasp::Convex> moving(const ArmWithTool& arm, const std::vector<grasp::Convex>& links) {
  std::size_t still = 0;
  while (still < arm.arm->capsules.size() && arm.arm->capsules[still].link == 0) ++still;
  return std::span(links).subspan(still);
}

/// Tells `look` of an arm along a way, piece by piece: straight in the joints, and straight in space where the arm can
/// follow that. Ends where it says false.
bool along_way(const ArmWithTool& arm, const Stop& from, std::span<const Stop> way,
               const std::function<bool(std::size_t move, const ArmBodies&)>& look) {
  constexpr double kStep_mm = 60, kStep = 10 * kDegree;  // between looks: less than the links are thick
  const Pose arm_from_base = base_from_arm(*arm.robot, *arm.arm, arm.waist).inverse();
  Stop last = from;
  for (std::size_t move_number = 0; move_number < way.size(); ++move_number) {
    const Stop& stop = way[move_number];
    const Vec3 move = stop.base_from_tcp.translation() - last.base_from_tcp.translation();
    const Vec3 turn = vector_from_rotation(stop.base_from_tcp.linear() * last.base_from_tcp.linear().transpose());
    const int steps = 1 + static_cast<int>(std::max(move.norm() / kStep_mm, turn.norm() / kStep));
    robot::ReachOptions options;
    options.from = last.joints;
    options.form = form_bits(*arm.arm, stop.joints);  // as the command says
    for (int i = 1; i <= steps; ++i) {
      const double share = static_cast<double>(i) / steps;
      robot::Joints joints{};
      for (std::size_t k = 0; k < joints.size(); ++k) joints[k] = (1 - share) * last.joints[k] + share * stop.joints[k];
      if (!look(move_number, pieces_of(arm, joints))) return false;
      Pose pose = last.base_from_tcp;
      pose.translation() += share * move;
      pose.linear() = rotation_from_vector(share * turn) * last.base_from_tcp.linear();
      const auto reached = reach(*arm.arm, arm_from_base * pose * arm.flange_from_tcp.inverse(), options);
      if (!reached) continue;  // a move of the joints does not come there
      if (!look(move_number, pieces_of(arm, reached->joints))) return false;
      options.from = reached->joints;
    }
    last = stop;
  }
  return true;
}

}  // namespace

bool arm_is_clear(const ArmWithTool& arm, const Stop& from, std::span<const Stop> way,
                  std::span<const grasp::Convex> bodies) {
  const auto clear = [&](std::span<const grasp::Convex> pieces, std::span<const grasp::Convex> of, double gap_mm) {
    return std::all_of(pieces.begin(), pieces.end(),
                       [&](const grasp::Convex& piece) { return clear_of(piece, of, gap_mm); });
  };
  return along_way(arm, from, way, [&](std::size_t, const ArmBodies& at) {
    return clear(at.links, bodies, kClear_mm) && clear(moving(arm, at.links), arm.others, kArmsClear_mm) &&
           clear(at.carried, arm.others, kArmsClear_mm);
  });
}

std::vector<grasp::Convex> bodies_at(const ArmWithTool& arm, const robot::Joints& joints) {
  ArmBodies at = pieces_of(arm, joints);
  const auto links = moving(arm, at.links);
  at.carried.insert(at.carried.end(), links.begin(), links.end());
  return std::move(at.carried);
}

std::vector<grasp::Convex> room_of_way(const ArmWithTool& arm, const Stop& from, std::span<const Stop> way) {
  struct Room {
    Vec3 min = Vec3::Constant(1e300), max = Vec3::Constant(-1e300);
  };
  std::vector<std::vector<Room>> rooms(way.size());
  const auto widen = [](Room& room, const grasp::Convex& body) {
    for (int k = 0; k < 3; ++k) {
      room.max[k] = std::max(room.max[k], grasp::reach_along(body, Vec3::Unit(k)));
      room.min[k] = std::min(room.min[k], -grasp::reach_along(body, -Vec3::Unit(k)));
    }
  };
  along_way(arm, from, way, [&](std::size_t move, const ArmBodies& at) {
    const auto links = moving(arm, at.links);
    rooms[move].resize(links.size() + at.carried.size());
    for (std::size_t k = 0; k < links.size(); ++k) widen(rooms[move][k], links[k]);
    for (std::size_t k = 0; k < at.carried.size(); ++k) widen(rooms[move][links.size() + k], at.carried[k]);
    return true;
  });
  std::vector<grasp::Convex> boxes;
  for (const std::vector<Room>& move : rooms)
    for (const Room& room : move) {
      Pose middle = Pose::Identity();
      middle.translation() = (room.min + room.max) / 2;
      boxes.push_back(grasp::make_box(middle, room.max - room.min));
    }
  return boxes;
}

std::vector<grasp::Convex> bodies_of(const CellBin& bin) {
  const Vec3& size = bin.inner_size_mm;
  const double wall = bin.wall_mm, x = (size.x() + wall) / 2, y = (size.y() + wall) / 2, z = size.z() / 2;
  std::vector<grasp::Convex> bodies;
  const auto add = [&](const Vec3& center, const Vec3& sides) {
    Pose pose = bin.base_from_bin;
    pose.translation() = bin.base_from_bin * center;
    bodies.push_back(grasp::make_box(pose, sides));
  };
  add(Vec3(0, 0, -wall / 2), Vec3(size.x(), size.y(), wall));
  for (const double side : {-1.0, 1.0}) {
    add(Vec3(side * x, 0, z), Vec3(wall, size.y(), size.z()));
    add(Vec3(0, side * y, z), Vec3(size.x(), wall, size.z()));
  }
  return bodies;
}

}  // namespace tribin::picking
