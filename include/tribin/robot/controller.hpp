#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "tribin/core/error.hpp"
#include "tribin/core/geometry.hpp"

/// What tribin asks of a robot controller, whatever it speaks. Positions are millimetres and degrees here, because they
/// are the controller's own numbers.
namespace tribin::robot {

/// How a command ended when it did not end well.
enum class ControllerFault {
  refused,          ///< the controller said no; `number` is its message
  not_sent,         ///< it did not take the command: nothing has happened
  unknown_outcome,  ///< it may have taken it: read before anything else is sent
  bad_answer,       ///< it answers something else than what it was asked, again and again
};

class ControllerError : public Error {
 public:
  ControllerError(ControllerFault fault, const std::string& message, int number = 0)
      : Error(ErrorCode::device, message), fault_(fault), number_(number) {}
  ControllerFault fault() const { return fault_; }
  int number() const { return number_; }  ///< decimal digits, as 2070; 0 where there is none

 private:
  ControllerFault fault_;
  int number_;
};

/// What a message number means, shortened; "refused" for unknown ones.
std::string message_of(int number);

struct ControllerStatus {
  bool step = false, one_cycle = false, continuous = false;
  bool running = false;
  bool safety_speed = false, teach = false, play = false;
  bool remote = false;
  bool held_by_pendant = false, held_externally = false, held_by_command = false;
  bool alarm = false, error = false;
  bool servo_on = false;
  bool held() const { return held_by_pendant || held_externally || held_by_command; }
  /// Remote, play, servo on, nothing held, nothing wrong.
  bool ready() const { return remote && play && servo_on && !held() && !alarm && !error; }
};
ControllerStatus status_from_bytes(unsigned first, unsigned second);
std::array<unsigned, 2> bytes_from_status(const ControllerStatus& status);

struct ControllerAlarm {
  int code = 0, data = 0;
};
struct ControllerAlarms {
  ControllerAlarm error;                ///< code 0 = none
  std::vector<ControllerAlarm> alarms;  ///< latest first
};

/// X, Y, Z [mm], Rx, Ry, Rz [deg] in a frame, with the form of the arm and the tool whose place it is.
struct CartesianPosition {
  int frame = 1;                    ///< 0 base, 1 robot, 2.. user frame 1..
  std::array<double, 6> numbers{};  ///< x, y, z, Rx, Ry, Rz
  int type = 0;                     ///< form bits, as form_bits gives them
  int tool = 0;
  double elbow_deg = 0;  ///< Re of a seven-axis arm, where the controller has it
};
CartesianPosition position_from_pose(const Pose& frame_from_tool, int type = 0, int tool = 0, int frame = 1);
Pose pose_of(const CartesianPosition& position);

struct PulsePosition {
  std::vector<long> pulses;  ///< S L U R B T, then what there is more
  int tool = 0;
};

using PositionVariable = std::variant<CartesianPosition, PulsePosition>;

/// Equal to the decimals that the wire keeps: 0.001 mm, and the angles' rounding.
bool same_position(const PositionVariable& a, const PositionVariable& b, double angle_step_deg);

struct RunningJob {
  std::string name;
  int line = 0, step = 0;
};

/// Proof that an operator asked for it: there is no other way to switch servos on, clear alarms, change the mode or
/// delete jobs.
class OperatorToken {
 public:
  /// \throws Error bad_option where the key is not the one that the configuration holds, or it holds none.
  static OperatorToken confirm(const std::string& given_key, const std::string& configured_key);

 private:
  OperatorToken() = default;
};

/// A controller that is driven by variables and a job of its own. One command at a time; see robot/controller_queue.hpp
/// for one that many threads may use.
/// \throws ControllerError from every function. What reads is repeated by the client itself; what writes or moves is
/// not,
///         but for a hold, and for what has surely not been taken.
class Controller {
 public:
  virtual ~Controller() = default;
  Controller() = default;
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  virtual ControllerStatus status() = 0;
  /// \param arm  1 or 2, of two; 0 = of the only one
  virtual CartesianPosition position(int frame = 1, int arm = 0) = 0;
  virtual PulsePosition pulses() = 0;
  virtual ControllerAlarms alarms() = 0;
  virtual RunningJob running_job() = 0;

  virtual int read_byte(int number) = 0;                   ///< B, 0..255
  virtual int read_integer(int number) = 0;                ///< I, 16 bit
  virtual long read_double(int number) = 0;                ///< D, 32 bit
  virtual double read_real(int number) = 0;                ///< R
  virtual PositionVariable read_position(int number) = 0;  ///< P

  virtual void write_byte(int number, int value) = 0;
  virtual void write_integer(int number, int value) = 0;
  virtual void write_double(int number, long value) = 0;
  virtual void write_real(int number, double value) = 0;
  virtual void write_position(int number, const PositionVariable& value) = 0;
  virtual double angle_step_deg() const = 0;  ///< what the wire keeps of angles

  /// On: what runs stops at once; repeated until the controller says that it has it. Off: nothing goes on by itself.
  virtual void hold(bool on) = 0;
  /// From the job's first line; an empty name goes on with the current one. Never sent twice.
  virtual void start_job(const std::string& name) = 0;

  virtual void set_servo(bool on, const OperatorToken& token) = 0;
  virtual void reset_alarm(const OperatorToken& token) = 0;
  virtual void cancel_error(const OperatorToken& token) = 0;
  virtual void set_play_mode(bool play, const OperatorToken& token) = 0;
  /// \throws ControllerError not_sent for "*": all jobs at once are never deleted.
  virtual void delete_job(const std::string& name, const OperatorToken& token) = 0;
};

}  // namespace tribin::robot
