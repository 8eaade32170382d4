#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tribin/robot/controller.hpp"
#include "tribin/robot/link.hpp"

/// The vision hand-shake: pick and place are commands to a job on the controller, which keeps interlocks, speeds and
/// the grip check. docs/robot.md has the variables; examples/robots/BPICK.JBI is the job.
namespace tribin::robot {

enum class CycleCommand { pick = 1, place = 2, put_back = 3, way_points = 4, turn_waist = 5 };
enum class CycleResult {
  done = 1,  ///< held, or released
  grip_missing = 2,
  fault = 3,
  part_lost = 4,  ///< on the way
};

/// One command to the job. A cycle number is never used for two commands in a row.
struct CycleOrder {
  CycleCommand command = CycleCommand::pick;
  int cycle = 1;                             ///< 1..32767
  int part_class = 0;                        ///< 0..255, for jobs of classes
  double opening_mm = 0;                     ///< of the jaws before they close, and when they let go; 0 = not said
  double waist_rad = 0;                      ///< turn_waist
  std::vector<CartesianPosition> positions;  ///< 3: before, at, after; way points: 1 to 6; waist: none
};

/// Zones of two arms: who is in the bin and at the rack (0 = nobody, else the arm's number). They stand in the
/// controller, so that they outlive the program; the arms' jobs do not go where another is.
enum class Zone { bin = 20, rack = 21 };  // B020, B021
/// The waist's angle [0.1 deg]: as wanted, and as it is.
inline constexpr int kWaistWanted = 4, kWaistIs = 5;  // I004, I005

/// Which variables: arm 2 of a dual-arm robot has B010, I010 and P020 on.
struct HandshakeVariables {
  int bytes = 0, integers = 0, positions = 0;
};

enum class CycleState {
  never_taken,  ///< the job knows nothing of the cycle
  under_way,    ///< taken, or stopped inside
  done,
};
/// What the controller says about a cycle; to be asked after any crash, before anything is sent.
struct CycleRecord {
  CycleState state = CycleState::never_taken;
  std::optional<CycleResult> result;  ///< of one that is done
};

struct HandshakeOptions {
  HandshakeVariables variables;
  double poll_s = 0.1;   ///< of B001 and RSTATS while it runs
  double take_s = 5;     ///< until the job has taken the command
  double finish_s = 60;  ///< until it is done
  double settle_s = 1;   ///< after an unknown outcome, before what may not have come is written again
  int attempts = 10;     ///< of writing and of reconnecting
  /// Asked at every poll; false puts the robot on hold and ends the cycle with an Error.
  std::function<bool(const ControllerStatus&)> may_go_on;
};

/// Gives the job one command and waits until it is done. Every variable is read back before the command itself is
/// written; where the outcome of that is unknown, the controller's acknowledgement decides, so that nothing moves
/// twice. \throws ControllerError  refused: not remote, not in play, held, alarm, job not running; unknown_outcome:
/// read the
///                          record, and let a person decide where it is under way.
CycleResult run_cycle(Controller& controller, Clock& clock, const CycleOrder& order,
                      const HandshakeOptions& options = {});

/// The two halves of run_cycle, for two arms at a time: `begin_cycle` comes back when the job has taken the command.
void begin_cycle(Controller& controller, Clock& clock, const CycleOrder& order, const HandshakeOptions& options = {});
/// One look at a cycle that was begun. \return none while it is under way
std::optional<CycleResult> look_at_cycle(Controller& controller, Clock& clock, int cycle,
                                         const HandshakeOptions& options = {});

/// Who has a zone, 0 = nobody.
int holder_of(Controller& controller, Clock& clock, Zone zone, const HandshakeOptions& options = {});
/// Takes a zone for an arm, or gives it back (0), until the controller says that it has it.
/// \throws ControllerError not_sent where another arm has it
void hand_zone(Controller& controller, Clock& clock, Zone zone, int arm, const HandshakeOptions& options = {});

CycleRecord read_record(Controller& controller, Clock& clock, int cycle, const HandshakeOptions& options = {});

/// Waits until a cycle that is under way is done.
CycleResult finish_cycle(Controller& controller, Clock& clock, int cycle, const HandshakeOptions& options = {});

/// 1..32767, then 1 again.
int next_cycle(int cycle);

}  // namespace tribin::robot
