#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tribin/picking/cycle.hpp"
#include "tribin/picking/place.hpp"

namespace tribin::picking {

/// A grasp and where its part goes.
struct Choice {
  grasp::Grasp grasp;
  grasp::PartHere part;
  Placing placing;
};

/// Finds out which grasp leads to a slot.
class Chooser {
 public:
  /// \throws Error bad_input where the cell lacks a rack, a gripper or a robot
  /// \param number  of the arm: index into WorkCell::robots
  Chooser(const WorkCell& cell, const robot::RobotModel& robot, Vision& vision, const robot::SafetyLimits& limits,
          std::size_t number = 0);

  const std::vector<Slot>& slots() const { return slots_; }
  /// The parts that a slot waits for, with all poses in which it may stand in one, or at the station.
  Places places(const Filling& filling) const;
  /// \param closely  more grasps of each part, where few do not lead to a slot
  grasp::PlanOptions plan_options(Resort resort, std::vector<grasp::FailedPick> failed, bool closely = false) const;
  bool has_more_grippers() const { return own_grippers().size() > 1; }
  /// Those that sit on the arm, in the file's order.
  std::vector<std::string> own_grippers() const;

  /// Of two arms: the waist's angle, and where the other one is, or may be meanwhile.
  void stand_among(double waist, std::vector<grasp::Convex> others);
  /// base_from_flange where it waits, but for a turn about the flange's axis; the identity for a single arm.
  Pose wait() const;
  bool waits() const { return cell_.robots.size() > 1 && cell_.robots[number_].wait.has_value(); }
  int arm_number() const { return static_cast<int>(number_) + 1; }

  /// Where the arm stands.
  struct Start {
    Pose base_from_flange = Pose::Identity();
    std::optional<robot::Joints> joints;
  };
  enum class Where {
    slots,    ///< the open ones
    station,  ///< as in a slot
    turned,   ///< at the station in one of the other ways
  };
  /// A part that a gripper is not to try now.
  struct Avoid {
    Vec3 part_at = Vec3::Zero();
    std::string gripper;
  };
  /// The best grasp that the arm gets to, and whose part can go to a place.
  /// \param start   none: not known yet
  /// \param wheres  kinds of place, in that order
  /// \param why     gets what software refuses
  std::optional<Choice> choose(const grasp::Plan& plan, const Filling& filling, const std::optional<Start>& start,
                               std::span<const Where> wheres, std::span<const Avoid> avoid,
                               std::vector<std::string>& why) const;
  /// The first place of that kind for a part that is held like this. \param start  where its way begins
  std::optional<Placing> place(const Entry& held, const Filling& filling, const Start& start, Where where) const;
  /// The same for a part that a grasp takes first. \param start  where the arm stands; none: its way is not looked at
  std::optional<Placing> place_after(const grasp::Grasp& grasp, const Filling& filling,
                                     const std::optional<Start>& start, Where where) const;
  /// The stops of a way; none where it is out of reach.
  std::optional<std::vector<Stop>> way(const Start& start, const Pose& base_from_tcp, const std::string& gripper,
                                       const Entry* held = nullptr) const;
  /// The same with the place where it leads as its last stop.
  std::optional<std::vector<Stop>> whole_way(const Start& start, const Pose& base_from_tcp, const std::string& gripper,
                                             const Entry* held = nullptr) const;

  /// A part in the hand to where the arm shows it: the last stop is there. None where that is out of reach, or not
  /// clear of the bin, full to its rim, and of what stands in the rack.
  std::optional<std::vector<Stop>> way_to_show(const Start& start, const Pose& base_from_flange, const Entry& held,
                                               const Filling& filling) const;
  /// How a part is held by a grasp, before a scan of it in the hand. \param covariance  of its pose, as PartHere's
  Grip grip_of(const std::string& gripper, const Pose& base_from_tcp, const Pose& tcp_from_part,
               const Matrix6& covariance, bool from_station) const;
  HeldPose held(const Grip& grip, const std::string& part, std::span<const HandLook> looks,
                bool believe_grip = true) const;

  /// \param held  what the gripper holds then: two arms keep it clear of each other
  ArmWithTool arm_with(const std::string& gripper, const Entry* held = nullptr) const;
  const grasp::GripperShape& shape(const std::string& gripper) const;
  int tool_of(const std::string& gripper) const;  ///< number on the controller, from 1 in the file's order
  const CellPart& cell_part(const std::string& name) const;
  bool has_station() const { return cell_.regrasp.has_value(); }
  Pose over_bin() const;  ///< the tool above the bin, at the height of its ways
  /// Where the tool goes when its part is put down: over the bin; or to where one of two arms waits, turned about the
  /// flange's axis as little as can be, since turns take longer than ways.
  Pose next_place(const std::string& gripper, const Start& from) const;
  /// The TCP's height at which nothing is in the way.
  double travel_mm() const;
  /// Reasons of software against the motion, the controller's state aside.
  std::vector<robot::Refusal> refusals_of(const Choice& choice, double scan_age_s) const;

 private:
  std::vector<Standing> standing(const Filling& filling) const;
  PlaceError error_of(const Choice& choice) const;
  /// Why a part may not go to a slot, by the last scan; empty = it may. Not asked where the rack does not say so.
  std::string scan_against(const Slot& slot, const CellPart& part) const;

  const WorkCell& cell_;
  const robot::RobotModel& robot_;
  Vision& vision_;
  const robot::SafetyLimits& limits_;
  std::size_t number_;
  double waist_ = 0;
  std::vector<grasp::Convex> others_;
  std::vector<Slot> slots_;
  std::vector<grasp::GripperShape> shapes_;
};

}  // namespace tribin::picking
