// What each command of host control does to the machine.

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tribin/controller_sim/sessions.hpp"
#include "tribin/robot/nx100.hpp"

namespace tribin::controller_sim {
namespace {

using robot::CartesianPosition;
using robot::PositionVariable;
using robot::PulsePosition;
namespace nx100 = robot::nx100;
using Numbers = std::optional<std::vector<double>>;

CommandAnswer refused(int number) { return {number, {}, 0}; }
CommandAnswer done(int number) { return {number, {}, 0}; }
CommandAnswer text(std::string data) { return {0, std::move(data), 0}; }

bool is_whole(double value, double least, double most) {
  return value == std::floor(value) && value >= least && value <= most;
}

/// Variables of a standard machine: 100 of each kind, 128 positions.
constexpr int kVariables = 100, kPositions = 128;
constexpr int kLastFrame = 25, kLastTool = 23;

std::string position_text(const CartesianPosition& position, int decimals) {
  // As LOADV writes it, without type and number of the variable.
  return nx100::loadv_data(0, position, {decimals}).substr(4);
}

std::string position_answer(Wire& wire, std::optional<Fault> fault, bool external) {
  const CartesianPosition position = wire.machine.position(wire.arm);
  std::string line = position_text(position, wire.angle_decimals).substr(2);  // without its form
  line.erase(0, line.find(',') + 1);                                          // and its frame
  if (external) line += ",0,0,0,0,0,0";
  if (fault == Fault::wrong_count) {
    constexpr int kCounts[] = {6, 7, 9, 13};
    const int wanted = kCounts[wire.dice.below(4)];
    int count = 1 + static_cast<int>(std::count(line.begin(), line.end(), ','));
    for (; count > wanted; --count) line.erase(line.rfind(','));
    for (; count < wanted; ++count) line += ",0";
  }
  return line;
}

CommandAnswer read_position(Wire& wire, const Numbers& n, std::optional<Fault> fault) {
  if (!n || n->size() != 2) return refused(1011);
  if (!is_whole((*n)[0], 0, kLastFrame) || !is_whole((*n)[1], 0, 1)) return refused(1012);
  if ((*n)[0] >= 2 && !wire.machine.user_frames.count(static_cast<int>((*n)[0]) - 1)) return refused(3350);
  return text(position_answer(wire, fault, (*n)[1] == 1));
}

CommandAnswer read_variable(Wire& wire, const Numbers& n) {
  if (!n || n->size() != 2) return refused(1011);
  if (!is_whole((*n)[0], 0, 6) || !is_whole((*n)[1], 0, (*n)[0] >= 4 ? kPositions - 1 : kVariables - 1))
    return refused(1012);
  const int number = static_cast<int>((*n)[1]);
  Machine& m = wire.machine;
  const auto get = [number](const auto& map) {
    const auto at = map.find(number);
    return at == map.end() ? 0 : at->second;
  };
  switch (static_cast<int>((*n)[0])) {
    case 0:
      return text(std::to_string(get(m.bytes)));
    case 1:
      return text(std::to_string(get(m.integers)));
    case 2:
      return text(std::to_string(get(m.doubles)));
    case 3:
      return text(nx100::loadv_data(nx100::VariableType::real, 0, get(m.reals)).substr(4));
    case 4: {
      const auto at = m.positions.find(number);
      if (at == m.positions.end()) return refused(4130);
      return text(nx100::loadv_data(0, at->second, {wire.angle_decimals}).substr(4));
    }
    default:
      return refused(4130);
  }
}

CommandAnswer write_variable(Wire& wire, const std::string& data, const Numbers& n) {
  if (!n || n->size() < 3) return refused(1011);
  if (!is_whole((*n)[0], 0, 6) || !is_whole((*n)[1], 0, (*n)[0] >= 4 ? kPositions - 1 : kVariables - 1))
    return refused(1012);
  const int type = static_cast<int>((*n)[0]), number = static_cast<int>((*n)[1]);
  Machine& m = wire.machine;
  if (type >= 4) {
    if (type != 4) return refused(1012);
    std::string rest = data.substr(data.find(',') + 1);
    rest.erase(0, rest.find(',') + 1);
    const std::optional<PositionVariable> position = nx100::position_variable_of(rest);
    if (!position) return refused(1011);
    m.positions[number] = *position;
    return done(0);
  }
  if (n->size() != 3) return refused(1011);
  const double value = (*n)[2];
  if (type == 0 && is_whole(value, 0, 255))
    m.bytes[number] = static_cast<int>(value);
  else if (type == 1 && is_whole(value, -32768, 32767))
    m.integers[number] = static_cast<int>(value);
  else if (type == 2 && is_whole(value, -2147483648.0, 2147483647.0))
    m.doubles[number] = static_cast<long>(value);
  else if (type == 3)
    m.reals[number] = static_cast<float>(value);
  else
    return refused(1012);
  return done(0);
}

/// MOVJ 16 fields, MOVL and IMOV 17.
CommandAnswer move(Wire& wire, const std::string& command, const Numbers& n) {
  if (const int number = wire.machine.check_ready(true)) return refused(number);
  const bool joint = command == "MOVJ";
  const std::size_t first = joint ? 1 : 2;
  if (!n) return refused(1012);
  if (n->size() != first + 15) return refused(1011);
  const double speed = (*n)[first - 1];
  const double* v = n->data() + first;
  const bool speed_kind = joint || is_whole((*n)[0], 0, 1);
  if (!speed_kind || !(speed >= (joint ? 0.01 : 0.1) && speed <= (joint ? 100 : 1500)) ||
      !is_whole(v[0], 0, kLastFrame) || !is_whole(v[7], 0, 65535) || !is_whole(v[8], 0, kLastTool))
    return refused(1012);
  CartesianPosition to;
  to.frame = static_cast<int>(v[0]);
  std::copy_n(v + 1, 6, to.numbers.begin());
  to.type = static_cast<int>(v[7]);
  to.tool = static_cast<int>(v[8]);
  return done(wire.machine.move(to, joint ? speed / 100 * 1500 : speed, command == "IMOV"));
}

CommandAnswer move_pulses(Wire& wire, const std::string& command, const Numbers& n) {
  if (const int number = wire.machine.check_ready(true)) return refused(number);
  const std::size_t first = command == "PMOVJ" ? 1 : 2;
  if (!n) return refused(1012);
  if (n->size() != first + 13) return refused(1011);
  PulsePosition to;
  for (std::size_t i = 0; i < 12; ++i) to.pulses.push_back(std::lround((*n)[first + i]));
  return done(wire.machine.move_pulses(to));
}

CommandAnswer write_frame(Wire& wire, const std::string& data, const Numbers& n) {
  if (!n || (n->size() != 23 && n->size() != 29)) return refused(1011);
  if (!is_whole((*n)[0], 1, kLastFrame - 1)) return refused(1012);
  const Vec3 org((*n)[1], (*n)[2], (*n)[3]), xx((*n)[8], (*n)[9], (*n)[10]), xy((*n)[15], (*n)[16], (*n)[17]);
  if ((xx - org).cross(xy - org).norm() < 1e-6) return refused(3360);  // no plane
  wire.machine.user_frames[static_cast<int>((*n)[0])] = data.substr(data.find(',') + 1);
  return done(0);
}

/// Eight points a byte, lowest number in bit 0; logical numbers 10.. are inputs, 10010.. outputs, others kept as they
/// come.
int io_byte(const Machine& machine, int group) {
  int byte = 0;
  for (int bit = 0; bit < 8; ++bit) {
    if (group >= 1 && group < 1000) byte |= machine.input((group - 1) * 8 + bit + 1) << bit;
    if (group >= 1001 && group < 2000) byte |= machine.output((group - 1001) * 8 + bit + 1) << bit;
  }
  const auto at = machine.network.find(group);
  return at == machine.network.end() ? byte : at->second;
}

CommandAnswer read_io(Wire& wire, const Numbers& n) {
  if (!n || n->size() != 2) return refused(1011);
  if (!is_whole((*n)[0], 10, 99990) || !is_whole((*n)[1], 8, 256) || static_cast<int>((*n)[1]) % 8 != 0)
    return refused(1012);
  std::string line;
  for (int i = 0; i < static_cast<int>((*n)[1]) / 8; ++i)
    line += (i ? "," : "") + std::to_string(io_byte(wire.machine, static_cast<int>((*n)[0]) / 10 + i));
  return text(line);
}

CommandAnswer write_io(Wire& wire, const Numbers& n) {
  if (!n || n->size() < 3) return refused(1011);
  if (!is_whole((*n)[0], 22010, 23287) || !is_whole((*n)[1], 8, 256)) return refused(1012);
  if (n->size() != 2 + static_cast<std::size_t>((*n)[1]) / 8) return refused(1011);
  for (std::size_t i = 2; i < n->size(); ++i) {
    if (!is_whole((*n)[i], 0, 255)) return refused(1012);
    wire.machine.network[static_cast<int>((*n)[0]) / 10 + static_cast<int>(i) - 2] = static_cast<int>((*n)[i]);
  }
  return done(0);
}

CommandAnswer job_wait(const Machine& machine, const Numbers& n) {
  if (!n || n->size() != 1) return refused(1011);
  if (!is_whole((*n)[0], -1, 32767)) return refused(1012);
  if (!machine.status().running) return text("0");
  // What will be then is not known here: a job that runs now counts as not ended.
  constexpr double kLongestWait_s = 60;
  return {0, "-1", (*n)[0] < 0 ? kLongestWait_s : std::min((*n)[0], kLongestWait_s)};
}

/// 1 or 0 (or what is allowed) for a switch; none else.
std::optional<int> choice(const Numbers& n, int least, int most) {
  if (!n || n->size() != 1 || !is_whole((*n)[0], least, most)) return std::nullopt;
  return static_cast<int>((*n)[0]);
}

CommandAnswer alarms(const Machine& machine) {
  std::string line = std::to_string(machine.error.code) + "," + std::to_string(machine.error.data);
  for (std::size_t i = 0; i < 4; ++i) {
    const robot::ControllerAlarm alarm =
        i < machine.alarm_list.size() ? machine.alarm_list[i] : robot::ControllerAlarm{};
    line += "," + std::to_string(alarm.code) + "," + std::to_string(alarm.data);
  }
  return text(line);
}

CommandAnswer job_names(const Machine& machine) {
  std::string line;
  for (const std::string& name : machine.job_names()) line += (line.empty() ? "" : ",") + name;
  return text(line);
}

CommandAnswer select_job(Machine& machine, const std::string& data) {
  const std::size_t comma = data.find(',');
  const auto line = comma == std::string::npos ? Numbers{} : nx100::numbers_of(data.substr(comma + 1));
  if (!line || line->size() != 1 || !is_whole((*line)[0], 0, 9999)) return refused(1011);
  return done(machine.select(data.substr(0, comma), static_cast<int>((*line)[0])));
}

/// Commands that only read.
std::optional<CommandAnswer> read_answer(Wire& wire, const std::string& command, const std::string& data,
                                         const Numbers& n, std::optional<Fault> fault) {
  Machine& m = wire.machine;
  const bool empty = data.empty();
  if (command == "RSTATS") {
    const auto bytes = bytes_from_status(m.status());
    return empty ? text(std::to_string(bytes[0]) + "," + std::to_string(bytes[1])) : refused(1011);
  }
  if (command == "RALARM") return empty ? alarms(m) : refused(1011);
  if (command == "RPOSC") return read_position(wire, n, fault);
  if (command == "RPOSJ") {
    std::string line;
    for (const long pulse : m.pulses()) line += (line.empty() ? "" : ",") + std::to_string(pulse);
    return empty ? text(line) : refused(1011);
  }
  if (command == "RJSEQ") {
    const robot::RunningJob job = m.running_job();
    return empty ? text(job.name + "," + std::to_string(job.line) + "," + std::to_string(job.step)) : refused(1011);
  }
  if (command == "JWAIT") return job_wait(m, n);
  if (command == "RGROUP") return empty ? text("1,0,0") : refused(1011);
  if (command == "RJDIR") return job_names(m);
  if (command == "SAVEV") return read_variable(wire, n);
  if (command == "IOREAD") return read_io(wire, n);
  if (command == "RUFRAME") {
    const auto number = choice(n, 1, kLastFrame - 1);
    if (!number) return refused(1012);
    const auto at = m.user_frames.find(*number);
    return at == m.user_frames.end() ? refused(3350) : text(at->second);
  }
  return std::nullopt;
}

}  // namespace

bool is_nx100_command(std::string_view name) {
  constexpr std::string_view kCommands[] = {
      "RALARM", "RPOSJ", "RPOSC",  "RSTATS",  "RJSEQ", "JWAIT", "RGROUP", "RJDIR", "RUFRAME", "SAVEV", "IOREAD",
      "SVON",   "HOLD",  "RESET",  "CANCEL",  "MODE",  "CYCLE", "HLOCK",  "MDSP",  "CGROUP",  "CTASK", "START",
      "JSEQ",   "SETMJ", "DELETE", "WUFRAME", "MOVJ",  "MOVL",  "IMOV",   "PMOVJ", "PMOVL",   "LOADV", "IOWRITE"};
  return std::find(std::begin(kCommands), std::end(kCommands), name) != std::end(kCommands);
}

CommandAnswer nx100_answer(Wire& wire, const std::string& command, const std::string& data,
                           std::optional<Fault> fault) {
  Machine& m = wire.machine;
  const Numbers n = nx100::numbers_of(data);
  if (std::optional<CommandAnswer> answer = read_answer(wire, command, data, n, fault)) {
    if (fault == Fault::blanks)
      for (std::size_t at = 0; (at = answer->data.find(',', at)) != std::string::npos; at += 2)
        answer->data.insert(at + 1, " ");
    return *answer;
  }
  if (command == "MOVJ" || command == "MOVL" || command == "IMOV") return move(wire, command, n);
  if (command == "PMOVJ" || command == "PMOVL") return move_pulses(wire, command, n);
  if (command == "START") return done(m.start(data));
  if (const int number = m.check_ready(false)) return refused(number);
  if (command == "LOADV") return write_variable(wire, data, n);
  if (command == "IOWRITE") return write_io(wire, n);
  if (command == "WUFRAME") return write_frame(wire, data, n);
  if (command == "JSEQ") return select_job(m, data);
  if (command == "SETMJ") return m.has_job(data) ? done(0) : refused(4040);
  if (command == "DELETE") return done(m.delete_job(data));
  if (command == "RESET") return data.empty() ? done(m.reset()) : refused(1011);
  if (command == "CANCEL") return data.empty() ? done(m.cancel()) : refused(1011);
  if (command == "MDSP") {
    if (data.size() > 30) return refused(1013);
    m.pendant_text = data;
    return done(0);
  }
  if (command == "CTASK") return n ? done(0) : refused(1011);
  if (command == "CGROUP") {
    if (!n || n->size() != 2) return refused(1011);
    const int bits = static_cast<int>((*n)[0]);
    if (bits < 1 || bits > m.arms()) return refused(3370);
    wire.arm = bits;
    return done(0);
  }
  const bool is_mode = command == "MODE", is_cycle = command == "CYCLE";
  if (is_mode || is_cycle || command == "SVON" || command == "HOLD" || command == "HLOCK") {
    if (!n || n->size() != 1) return refused(1011);
    const auto value = is_mode ? choice(n, 1, 2) : is_cycle ? choice(n, 1, 3) : choice(n, 0, 1);
    if (!value) return refused(1012);
    if (is_mode) return done(m.mode(*value == 2));
    if (is_cycle) m.cycle_mode = *value;
    if (command == "SVON") return done(m.servo(*value == 1));
    if (command == "HOLD") return done(m.hold(*value == 1));
    return done(0);
  }
  return refused(1010);
}

}  // namespace tribin::controller_sim
