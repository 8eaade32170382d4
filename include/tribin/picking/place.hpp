#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tribin/grasp/grasp.hpp"
#include "tribin/grasp/gripper_shape.hpp"
#include "tribin/kinematics/inverse.hpp"
#include "tribin/part/part.hpp"
#include "tribin/picking/rack.hpp"

/// Putting down a part that is in the hand: where, and the way there. Base frame.
namespace tribin::picking {

/// The arm with a gripper on it.
struct ArmWithTool {
  const robot::RobotModel* robot = nullptr;
  const robot::Arm* arm = nullptr;
  Pose flange_from_tcp = Pose::Identity();
  double waist = 0;  ///< [rad]
  std::optional<CellRange> workspace;
  std::vector<grasp::Convex> on_tcp;  ///< gripper and what it holds, frame of the TCP: kept clear of the others
  std::vector<grasp::Convex> others;  ///< where another arm is, or may be meanwhile
  double limit_margin_rad = 2 * kDegree;
  double singularity = 0.1;
};

/// A place of the tool with the joint angles that bring it there.
struct Stop {
  Pose base_from_tcp = Pose::Identity();
  robot::Joints joints{};
};

/// A part's box.
grasp::Convex box_of(const Part& part, const Pose& frame_from_part);

/// How to stand at each of the places, in one configuration, with no turn that is not needed. \return none where one is
/// out of reach or of the workspace
std::optional<std::vector<Stop>> stops_at(const ArmWithTool& arm, std::span<const Pose> base_from_tcp,
                                          const std::optional<robot::Joints>& from = {}, bool one_form = true);

/// A part in the hand.
struct Held {
  const Part* part = nullptr;
  const grasp::GripperShape* gripper = nullptr;
  double opening_mm = 0;  ///< of the jaws when they let go
  Pose tcp_from_part = Pose::Identity();
};

/// A place that was found.
struct Placing {
  const Slot* slot = nullptr;  ///< none = the station
  Pose base_from_part = Pose::Identity();
  std::array<Stop, 3> stops;  ///< before, at, after
};

/// What already stands where a part is to be put.
struct Standing {
  const Part* part = nullptr;
  Pose base_from_part = Pose::Identity();
};

/// The first of the slots in which the part can be put: reached before, at and after in one configuration, the open
/// gripper and the part clear of what stands there and of the slot's own plane.
/// \param slot_from_part  how it stands in a slot, any of them
/// \param good            what else it must be, its way among it; none: nothing
std::optional<Placing> plan_place(const ArmWithTool& arm, const Held& held, std::span<const Slot* const> slots,
                                  std::span<const Pose> slot_from_part, std::span<const Standing> standing,
                                  const std::function<bool(const Placing&)>& good = {});

/// Way points between two places of the tool, the last one excluded: up, across at a safe height, and above where it
/// goes; or the taught ones. At most six. The tool turns at one end only, the one that is farther from `keep_still`
/// (the bin: a tool that turns over it sweeps its walls).
/// \param travel_mm  the safe height of the TCP
std::vector<Pose> way_between(const Pose& from, const Pose& to, double travel_mm, std::span<const Pose> taught,
                              const Vec3& keep_still);

/// Whether an arm's links keep clear of bodies on a way, taken straight in space as well as straight in the joints; and
/// of the other arm, with all that it carries.
bool arm_is_clear(const ArmWithTool& arm, const Stop& from, std::span<const Stop> way,
                  std::span<const grasp::Convex> bodies);

/// What of an arm moves, at joint angles, with all that it carries. Base frame.
std::vector<grasp::Convex> bodies_at(const ArmWithTool& arm, const robot::Joints& joints);

/// Boxes that an arm with all it carries stays in on such a way, one a piece and move. Base frame, along its axes.
std::vector<grasp::Convex> room_of_way(const ArmWithTool& arm, const Stop& from, std::span<const Stop> way);

/// Floor and walls of a bin, base frame.
std::vector<grasp::Convex> bodies_of(const CellBin& bin);

}  // namespace tribin::picking
