#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/kinematics/inverse.hpp"
#include "tribin/robot/controller.hpp"
#include "tribin/robot/link.hpp"

/// What software refuses before a robot moves. It protects parts and grippers; people are protected by the controller's
/// hard-wired circuits and by who integrates the robot, never by this.
namespace tribin::robot {

enum class RefusalCode {
  dry_run,          ///< --arm was not given
  arm_not_allowed,  ///< the configuration does not allow it
  not_loopback,     ///< listening beyond this machine without setting and key
  second_client,    ///< another client moves the robot
  operator_needed,  ///< servo, reset, cancel, mode, delete, user frames
  no_status,        ///< the controller's status is not known, or too old
  not_remote,
  not_play,
  alarm,
  error,
  held,
  servo_off,
  running,     ///< something runs already
  not_finite,  ///< NaN or infinity in a pose or speed
  not_rotation,
  workspace,  ///< outside the box, or none is given
  forbidden,  ///< inside a forbidden box
  scan_old,
  scan_other,     ///< poses of another scan than the last
  scene_changed,  ///< a part was taken since
  confidence,
  visibility,
  no_solution,  ///< of the joints
  form_change,  ///< between pre-pick, pick and retreat
  limit_margin,
  singularity,
  speed,
  tool,   ///< unknown number, or its frame not confirmed
  frame,  ///< unknown number
  hand_eye_missing,
  hand_eye_old,
  hand_eye_poor,
  slot_occupied,
  slot_class,
};
inline constexpr int kRefusalCodes = 34;
/// "dry_run", ... stable: programs compare them.
std::string_view name_of(RefusalCode code);

struct Refusal {
  RefusalCode code;
  std::string message;  ///< what was seen, what was wanted
};

struct Box {
  Vec3 min = Vec3::Zero(), max = Vec3::Zero();  ///< [mm] along the axes of the base
};

/// What a cell allows. Caps are raised by a local configuration file only, never by a client.
struct SafetyLimits {
  bool allow_arm = false;             ///< the configuration's consent
  bool allow_remote_clients = false;  ///< to listen beyond this machine; wants a key as well
  std::optional<Box> workspace;       ///< where the TCP may be; none = nowhere
  std::vector<Box> forbidden;
  double speed_mm_s = 250;  ///< what people may stand beside, at reduced speed
  double joint_speed_percent = 10;
  double scan_max_age_s = 10;
  double status_max_age_s = 0.2;
  double min_score = 0.9;    ///< of an instance
  double min_visible = 0.2;  ///< share of the part that the camera sees
  double limit_margin_rad = 2 * kDegree;
  double singularity = 0.1;    ///< |sin|, see Margins
  std::set<int> tools{};       ///< numbers whose frames were confirmed on the controller
  std::set<int> frames{0, 1};  ///< 0 base, 1 robot
  double hand_eye_max_age_days = 180;
  double hand_eye_max_sigma_mm = 1;
};

enum class CommandKind {
  read,
  stop,             ///< hold: never refused
  motion,           ///< a job's command, a start, a host move
  operator_action,  ///< servo, reset, cancel, mode, delete, user frame
  listen,           ///< to open a port for clients
};

/// A slot of the rack that a place goes to.
struct SlotFacts {
  bool occupied = false;
  bool class_allowed = true;
};

/// What is known of the scan that a pick goes by.
struct ScanFacts {
  double age_s = 0;
  int scene = 0, latest_scene = 0;
  bool changed = false;  ///< a part was taken, or something moved, since
  double score = 1, visible = 1;
};

struct HandEyeFacts {
  double age_days = 0;
  double sigma_mm = 0;
};

/// Pre-pick, pick and retreat (or more) with the speed at which they are gone to.
struct MotionFacts {
  std::vector<Pose> base_from_tcp;
  std::vector<Pose> arm_from_flange;  ///< the same places for the arm's own kinematics; empty = not checked here
  const Arm* arm = nullptr;
  double speed_mm_s = 100;
  double joint_speed_percent = 10;
  int tool = 0, frame = 1;
  std::optional<ScanFacts> scan;         ///< of picks
  std::optional<HandEyeFacts> hand_eye;  ///< none = there is no calibration
  bool needs_hand_eye = true;            ///< poses that come from a camera do
  std::optional<SlotFacts> slot;         ///< of places
};

struct CommandFacts {
  CommandKind kind = CommandKind::read;
  bool arm = false;  ///< --arm was given
  bool other_client_moves = false;
  bool operator_token = false;
  std::string listen_address = "127.0.0.1";
  bool has_key = false;  ///< clients must show one
  std::optional<ControllerStatus> status;
  double status_age_s = 0;
  bool by_running_job = false;  ///< the command goes to a job that runs: then running is right, and wanted
  MotionFacts motion;
};

/// The gate in front of every command: all reasons against it, in the order of RefusalCode. Empty: it may go.
std::vector<Refusal> refusals(const CommandFacts& command, const SafetyLimits& limits);

/// \throws Error device, with the code and message of each refusal.
void require_allowed(const CommandFacts& command, const SafetyLimits& limits);

/// Whether only programs of this machine can reach an address.
bool is_loopback(const std::string& address);

/// What a watchdog knows at a moment.
struct WatchFacts {
  double now_s = 0;
  double status_s = 0;                       ///< when the controller was last heard
  double client_s = 0;                       ///< when the client was last heard
  double scan_s = 0;                         ///< when the scan was taken
  std::optional<Vec3> expected_mm, seen_mm;  ///< of the TCP
  bool operator_stop = false;
};
struct WatchLimits {
  double silence_s = 1;  ///< of the controller
  double client_s = 2;   ///< of the client
  double scan_s = 60;    ///< of a scan while it is worked off
  double jump_mm = 50;   ///< between where the tool is and where it should be
};
/// Why the robot must be put on hold now. \return empty: no reason
std::string hold_reason(const WatchFacts& facts, const WatchLimits& limits = {});

/// A controller behind the gate. Without `arm` it is a dry run: what reads and what stops goes through, nothing else
/// leaves. With it, positions and starts pass the gate; destroying it puts a robot on hold that was started through it.
/// \param sink  told of what a dry run kept back, as a sentence; may be empty
std::unique_ptr<Controller> make_guarded(std::unique_ptr<Controller> controller, const SafetyLimits& limits, bool arm,
                                         std::function<void(const std::string&)> sink = {});

}  // namespace tribin::robot
