#include "tribin/robot/safety.hpp"

#include <arpa/inet.h>

#include <cmath>
#include <cstdio>

namespace tribin::robot {
namespace {

constexpr std::string_view kNames[kRefusalCodes] = {
    "dry_run",      "arm_not_allowed", "not_loopback",  "second_client", "operator_needed",
    "no_status",    "not_remote",      "not_play",      "alarm",         "error",
    "held",         "servo_off",       "running",       "not_finite",    "not_rotation",
    "workspace",    "forbidden",       "scan_old",      "scan_other",    "scene_changed",
    "confidence",   "visibility",      "no_solution",   "form_change",   "limit_margin",
    "singularity",  "speed",           "tool",          "frame",         "hand_eye_missing",
    "hand_eye_old", "hand_eye_poor",   "slot_occupied", "slot_class"};

std::string text(double value) {
  char out[32];
  std::snprintf(out, sizeof out, "%.4g", value);
  return out;
}

class Gate {
 public:
  Gate(const CommandFacts& command, const SafetyLimits& limits) : c_(command), l_(limits) {}

  std::vector<Refusal> run() {
    if (c_.kind == CommandKind::listen) {
      refuse_if(!is_loopback(c_.listen_address) && !(l_.allow_remote_clients && c_.has_key), RefusalCode::not_loopback,
                "saw the address " + c_.listen_address +
                    ", wanted this machine alone, or the setting that allows clients "
                    "from elsewhere with a key");
    }
    if (c_.kind == CommandKind::operator_action || c_.kind == CommandKind::motion) consent();
    if (c_.kind == CommandKind::operator_action)
      refuse_if(!c_.operator_token, RefusalCode::operator_needed,
                "only an operator may ask for this, with the key of the cell");
    if (c_.kind == CommandKind::motion) {
      controller();
      poses();
      scan();
      kinematics();
      caps();
      hand_eye();
      slot();
    }
    return std::move(found_);
  }

 private:
  void refuse_if(bool condition, RefusalCode code, std::string message) {
    if (condition) found_.push_back({code, std::move(message)});
  }

  void consent() {
    refuse_if(!c_.arm, RefusalCode::dry_run, "a dry run: --arm was not given");
    refuse_if(!l_.allow_arm, RefusalCode::arm_not_allowed, "the work cell does not say allow_arm = true");
    refuse_if(c_.other_client_moves, RefusalCode::second_client, "another client moves the robot");
  }

  void controller() {
    if (!c_.status || !(c_.status_age_s <= l_.status_max_age_s)) {
      refuse_if(true, RefusalCode::no_status,
                c_.status ? "the controller's status is " + text(c_.status_age_s) + " s old, wanted at most " +
                                text(l_.status_max_age_s)
                          : "the controller's status is not known");
      if (!c_.status) return;
    }
    const ControllerStatus& s = *c_.status;
    refuse_if(!s.remote, RefusalCode::not_remote, "the controller is not in remote");
    refuse_if(!s.play || s.teach, RefusalCode::not_play, "the controller is not in play");
    refuse_if(s.alarm, RefusalCode::alarm, "the controller has an alarm");
    refuse_if(s.error, RefusalCode::error, "the controller has an error");
    refuse_if(s.held(), RefusalCode::held, "the robot is on hold");
    refuse_if(!s.servo_on, RefusalCode::servo_off, "servos are off, and are never switched on by a program");
    refuse_if(s.running && !c_.by_running_job, RefusalCode::running, "something runs already");
  }

  void poses() {
    bool finite = std::isfinite(c_.motion.speed_mm_s) && std::isfinite(c_.motion.joint_speed_percent), rotations = true;
    for (const auto* list : {&c_.motion.base_from_tcp, &c_.motion.arm_from_flange})
      for (const Pose& pose : *list) {
        const Eigen::Matrix3d r = pose.linear();
        finite = finite && r.allFinite() && pose.translation().allFinite();
        // A millionth is far above rounding and far below what a wrong matrix shows.
        rotations = rotations && (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
                    r.determinant() > 0;
      }
    refuse_if(!finite, RefusalCode::not_finite, "a pose or a speed is not finite");
    refuse_if(finite && !rotations, RefusalCode::not_rotation, "a pose's matrix is no rotation");
    usable_ = finite && rotations;
    bool inside = l_.workspace.has_value(), forbidden = false;
    for (const Pose& pose : c_.motion.base_from_tcp) {
      const Vec3 p = pose.translation();
      // Written so that what is not finite is outside.
      inside =
          inside && (p.array() >= l_.workspace->min.array()).all() && (p.array() <= l_.workspace->max.array()).all();
      for (const Box& box : l_.forbidden)
        forbidden = forbidden || ((p.array() >= box.min.array()).all() && (p.array() <= box.max.array()).all());
    }
    refuse_if(!inside, RefusalCode::workspace,
              l_.workspace ? "a pose lies outside the workspace" : "the work cell gives no workspace");
    refuse_if(forbidden, RefusalCode::forbidden, "a pose lies in a forbidden box");
  }

  void scan() {
    if (!c_.motion.scan) return;
    const ScanFacts& s = *c_.motion.scan;
    refuse_if(!(s.age_s <= l_.scan_max_age_s), RefusalCode::scan_old,
              "the scan is " + text(s.age_s) + " s old, wanted at most " + text(l_.scan_max_age_s));
    refuse_if(
        s.scene != s.latest_scene, RefusalCode::scan_other,
        "the pose belongs to scene " + std::to_string(s.scene) + ", the latest is " + std::to_string(s.latest_scene));
    refuse_if(s.changed, RefusalCode::scene_changed, "the scene has changed since it was scanned");
    refuse_if(!(s.score >= l_.min_score), RefusalCode::confidence,
              "score " + text(s.score) + ", wanted at least " + text(l_.min_score));
    refuse_if(!(s.visible >= l_.min_visible), RefusalCode::visibility,
              "visible share " + text(s.visible) + ", wanted at least " + text(l_.min_visible));
  }

  void kinematics() {
    if (!c_.motion.arm || !usable_) return;
    const Arm& arm = *c_.motion.arm;
    std::optional<Reach> last;
    for (const Pose& pose : c_.motion.arm_from_flange) {
      ReachOptions options;
      if (last) {
        options.from = last->joints;
        options.form = form_bits(arm, last->joints);
      }
      std::optional<Reach> now = reach(arm, pose, options);
      if (!now && last) {
        options.form.reset();
        now = reach(arm, pose, options);
        refuse_if(now.has_value(), RefusalCode::form_change, "the arm would change its configuration on the way");
      }
      if (!now) return refuse_if(true, RefusalCode::no_solution, "the arm cannot reach a pose inside its limits");
      refuse_if(now->margins.limit < l_.limit_margin_rad, RefusalCode::limit_margin,
                "a joint stands " + text(now->margins.limit / kDegree) + " deg from its limit, wanted " +
                    text(l_.limit_margin_rad / kDegree));
      refuse_if(
          now->margins.singularity < l_.singularity, RefusalCode::singularity,
          "the arm is near a singularity: " + text(now->margins.singularity) + ", wanted " + text(l_.singularity));
      last = now;
    }
  }

  void caps() {
    refuse_if(!(c_.motion.speed_mm_s <= l_.speed_mm_s && c_.motion.joint_speed_percent <= l_.joint_speed_percent),
              RefusalCode::speed,
              "speed " + text(c_.motion.speed_mm_s) + " mm/s, " + text(c_.motion.joint_speed_percent) + " %; allowed " +
                  text(l_.speed_mm_s) + " mm/s, " + text(l_.joint_speed_percent) + " %");
    refuse_if(!l_.tools.count(c_.motion.tool), RefusalCode::tool,
              "the frame of tool " + std::to_string(c_.motion.tool) + " is not confirmed");
    refuse_if(!l_.frames.count(c_.motion.frame), RefusalCode::frame,
              "frame " + std::to_string(c_.motion.frame) + " is not known");
  }

  void hand_eye() {
    if (!c_.motion.needs_hand_eye) return;
    if (!c_.motion.hand_eye) return refuse_if(true, RefusalCode::hand_eye_missing, "there is no hand-eye calibration");
    refuse_if(!(c_.motion.hand_eye->age_days <= l_.hand_eye_max_age_days), RefusalCode::hand_eye_old,
              "the hand-eye calibration is " + text(c_.motion.hand_eye->age_days) + " days old, wanted at most " +
                  text(l_.hand_eye_max_age_days));
    refuse_if(!(c_.motion.hand_eye->sigma_mm <= l_.hand_eye_max_sigma_mm), RefusalCode::hand_eye_poor,
              "the hand-eye calibration has sigma " + text(c_.motion.hand_eye->sigma_mm) + " mm, wanted at most " +
                  text(l_.hand_eye_max_sigma_mm));
  }

  void slot() {
    if (!c_.motion.slot) return;
    refuse_if(c_.motion.slot->occupied, RefusalCode::slot_occupied, "the slot is occupied");
    refuse_if(!c_.motion.slot->class_allowed, RefusalCode::slot_class, "the slot does not take this class");
  }

  const CommandFacts& c_;
  const SafetyLimits& l_;
  bool usable_ = false;
  std::vector<Refusal> found_;
};

}  // namespace

std::string_view name_of(RefusalCode code) { return kNames[static_cast<int>(code)]; }

std::vector<Refusal> refusals(const CommandFacts& command, const SafetyLimits& limits) {
  return Gate(command, limits).run();
}

void require_allowed(const CommandFacts& command, const SafetyLimits& limits) {
  std::string all;
  for (const Refusal& refusal : refusals(command, limits))
    all += (all.empty() ? "refused: " : "; ") + std::string(name_of(refusal.code)) + ": " + refusal.message;
  if (!all.empty()) throw Error(ErrorCode::device, all);
}

bool is_loopback(const std::string& address) {
  in_addr v4{};
  if (inet_pton(AF_INET, address.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  return address == "::1" || address == "localhost";
}

std::string hold_reason(const WatchFacts& f, const WatchLimits& l) {
  if (f.operator_stop) return "the operator's stop";
  if (!(f.now_s - f.status_s <= l.silence_s))
    return "the controller was not heard for " + text(f.now_s - f.status_s) + " s";
  if (!(f.now_s - f.client_s <= l.client_s)) return "the client was not heard for " + text(f.now_s - f.client_s) + " s";
  if (!(f.now_s - f.scan_s <= l.scan_s)) return "the scan is " + text(f.now_s - f.scan_s) + " s old";
  if (f.expected_mm && f.seen_mm && !((*f.expected_mm - *f.seen_mm).norm() <= l.jump_mm))
    return "the tool is " + text((*f.expected_mm - *f.seen_mm).norm()) + " mm from where it should be";
  return {};
}

}  // namespace tribin::robot
