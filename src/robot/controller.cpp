#include "tribin/robot/controller.hpp"

#include <cmath>

#include "tribin/kinematics/rotation_conventions.hpp"

namespace tribin::robot {

std::string message_of(int number) {
  switch (number) {
    case 1010:
      return "unknown command";
    case 1011:
      return "wrong number of operands";
    case 1012:
      return "operand out of range";
    case 1013:
      return "operand of wrong length";
    case 1020:
      return "disk full";
    case 2010:
      return "the manipulator is moving";
    case 2020:
      return "held by the pendant";
    case 2030:
      return "held by the panel";
    case 2040:
      return "held by an external signal";
    case 2050:
      return "held by command";
    case 2060:
      return "an error or alarm is present";
    case 2070:
      return "servos are off";
    case 2080:
      return "wrong mode";
    case 2090:
      return "the file is in use";
    case 2100:
      return "command remote is not set";
    case 2110:
      return "data cannot be read";
    case 2120:
      return "data cannot be loaded";
    case 2130:
      return "the data is being edited";
    case 2150:
      return "coordinate conversion is running";
    case 3010:
      return "turn servos on";
    case 3040:
      return "home position wanted";
    case 3050:
      return "positions are to be confirmed";
    case 3070:
      return "no current value";
    case 3220:
    case 3230:
      return "the panel is locked";
    case 3350:
      return "the user frame was never taught";
    case 3360:
      return "the user frame is broken";
    case 3370:
      return "wrong control group";
    case 3450:
      return "servos cannot be turned on";
    case 3460:
      return "the coordinate system cannot be set";
    case 4010:
    case 4012:
      return "memory full";
    case 4030:
      return "the job exists already";
    case 4040:
      return "no such job";
    case 4060:
      return "set a job first";
    case 4120:
      return "position data broken";
    case 4130:
      return "no such position data";
    case 4140:
      return "wrong kind of position variable";
    case 4190:
      return "bad character in a job's name";
    case 4420:
      return "not accepted";
    case 5110:
      return "syntax";
    case 5120:
      return "position data";
    case 5130:
      return "NOP or END missing";
    case 5200:
      return "value out of range";
    default:
      return "refused";
  }
}

ControllerStatus status_from_bytes(unsigned first, unsigned second) {
  const auto a = [first](int bit) { return (first >> bit & 1) != 0; };
  const auto b = [second](int bit) { return (second >> bit & 1) != 0; };
  ControllerStatus s;
  s.step = a(0), s.one_cycle = a(1), s.continuous = a(2), s.running = a(3);
  s.safety_speed = a(4), s.teach = a(5), s.play = a(6), s.remote = a(7);
  s.held_by_pendant = b(1), s.held_externally = b(2), s.held_by_command = b(3);
  s.alarm = b(4), s.error = b(5), s.servo_on = b(6);
  return s;
}

std::array<unsigned, 2> bytes_from_status(const ControllerStatus& s) {
  const auto bits = [](std::initializer_list<bool> values) {
    unsigned byte = 0, bit = 1;
    for (const bool value : values) byte |= value ? bit : 0, bit <<= 1;
    return byte;
  };
  return {bits({s.step, s.one_cycle, s.continuous, s.running, s.safety_speed, s.teach, s.play, s.remote}),
          bits({false, s.held_by_pendant, s.held_externally, s.held_by_command, s.alarm, s.error, s.servo_on})};
}

CartesianPosition position_from_pose(const Pose& pose, int type, int tool, int frame) {
  CartesianPosition position;
  const std::vector<double> numbers = numbers_from_pose(Convention::yaskawa, pose);
  std::copy(numbers.begin(), numbers.end(), position.numbers.begin());
  position.type = type;
  position.tool = tool;
  position.frame = frame;
  return position;
}

Pose pose_of(const CartesianPosition& position) { return pose_from_numbers(Convention::yaskawa, position.numbers); }

bool same_position(const PositionVariable& a, const PositionVariable& b, double angle_step_deg) {
  if (a.index() != b.index()) return false;
  if (const auto* pulses = std::get_if<PulsePosition>(&a)) {
    // Controllers fill up with zeros what was left out.
    const auto& other = std::get<PulsePosition>(b);
    for (std::size_t i = 0; i < std::max(pulses->pulses.size(), other.pulses.size()); ++i)
      if ((i < pulses->pulses.size() ? pulses->pulses[i] : 0) != (i < other.pulses.size() ? other.pulses[i] : 0))
        return false;
    return pulses->tool == other.tool;
  }
  const auto& p = std::get<CartesianPosition>(a);
  const auto& q = std::get<CartesianPosition>(b);
  if (p.frame != q.frame || p.type != q.type || p.tool != q.tool) return false;
  for (int i = 0; i < 6; ++i) {
    // One step is what two roundings may differ by; a hair more for the decimal's own representation.
    const double step = (i < 3 ? 1e-3 : angle_step_deg) * 1.001;
    const double d = p.numbers[i] - q.numbers[i];
    if (!(std::abs(i < 3 ? d : std::remainder(d, 360.0)) <= step)) return false;
  }
  return true;
}

OperatorToken OperatorToken::confirm(const std::string& given, const std::string& configured) {
  if (configured.empty())
    throw Error(ErrorCode::bad_option, "the configuration holds no operator key: no such commands");
  if (given != configured) throw Error(ErrorCode::bad_option, "the operator key is not the one of the configuration");
  return {};
}

}  // namespace tribin::robot
