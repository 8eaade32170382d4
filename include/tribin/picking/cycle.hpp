#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tribin/picking/journal.hpp"
#include "tribin/picking/vision.hpp"
#include "tribin/robot/handshake.hpp"
#include "tribin/robot/safety.hpp"

/// The pick-and-place cycle: scan, find, choose, plan, pick, check the grip, place, again.
namespace tribin::picking {

/// Where the cycle is. Each phase ends with the next one.
enum class Phase {
  recover,  ///< what the journal leaves open is asked of the controller
  scan,
  choose,  ///< the best grasp that can be placed; none: the next resort
  pick,
  show,     ///< the part in the hand is measured, where the cell has [in_hand]
  place,    ///< or put down at the station
  regrasp,  ///< pick it from there
  push,
  end,
};
std::string_view name_of(Phase phase);

/// What is tried, in this order, when nothing can be picked.
enum class Resort { none, next_gripper, full_tilt, next_look, push };
std::string_view name_of(Resort resort);

/// What a scan of the part in the hand told.
struct InHandReport {
  bool measured = false;           ///< false: the part is placed as the grip implies, and `why` tells for what reason
  double sigma_mm = 0;             ///< of its place in the hand
  double moved_mm = 0, moved = 0;  ///< from where the grip implies, and its turn [rad]
  std::string why;
};

/// One line of the run's report.
struct CycleReport {
  std::string state;  ///< placed, put_down, missed, lost, pushed, no_pick
  int cycle = 0, scene = 0;
  int arm = 0;  ///< of two; 0 = there is one
  std::string part, gripper, grasp;
  int slot = 0;
  Resort resort = Resort::none;
  Pose base_from_part = Pose::Identity(), base_from_tcp = Pose::Identity();  ///< as picked
  double score = 0;
  std::vector<grasp::Term> terms;
  std::vector<grasp::WhyCount> refused;  ///< of the last plan
  std::map<std::string, int> seen;
  std::optional<InHandReport> in_hand;
  double find_ms = 0, plan_ms = 0;  ///< of this machine
  double robot_s = 0;               ///< since the cycle's scan, by the controller's clock
  std::string note;
};

/// How a run ended.
struct RunEnd {
  std::string status;   ///< rack_full, empty, not_empty_no_object, not_pickable, part_missing, no_data,
                        ///< calibration_suspect, in_doubt, most_parts, recovered
  std::string message;  ///< one sentence for people
  int placed = 0;       ///< in this run
};

/// What an operator says to a run that was in doubt. The hand was emptied either way.
enum class Answer { slot_full, slot_empty };

struct RunOptions {
  robot::HandshakeOptions handshake;
  std::optional<Answer> answer;
  int most_parts = 0;         ///< > 0: stop then
  bool recover_only = false;  ///< settle what a crash left open, and stop
  std::function<void(const CycleReport&)> told;
  std::function<void(Phase)> entered;  ///< each phase, before it begins
};

/// What a run works with; all must outlive it.
struct RunLinks {
  const WorkCell* cell = nullptr;
  const robot::RobotModel* robot = nullptr;
  Vision* vision = nullptr;
  robot::Controller* controller = nullptr;  ///< behind the gate (make_guarded)
  robot::Clock* clock = nullptr;
  Journal* journal = nullptr;
  robot::SafetyLimits limits;
};

/// Picks and places until the bin is empty, the rack is full, nothing can be picked, or an operator is needed.
/// Retries: a grasp that failed is not tried again in the next three scans. Nothing to pick: the parts' other grippers,
/// then their full tilt, then a camera on the flange looks from its next place, then a push (one a scan, at most five
/// in a row), then it asks. \throws Error device (the robot does not do what it is told: the journal says where it
/// was), bad_input (the cell lacks a rack, a gripper, a robot)
RunEnd run_picking(const RunLinks& links, const RunOptions& options);

/// What a run would do first, without a robot: one scan, one plan. \param filling  of the rack
/// \param flange  of a camera on it, as for Vision::scan
CycleReport plan_first(const WorkCell& cell, const robot::RobotModel& robot, Vision& vision, const Filling& filling,
                       const robot::SafetyLimits& limits, const FlangePose& flange = {});

}  // namespace tribin::picking
