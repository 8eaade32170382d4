// The lines of host control, both ways.

#include <charconv>
#include <cmath>

#include "tribin/core/error.hpp"
#include "tribin/robot/nx100.hpp"

namespace tribin::robot::nx100 {
namespace {

// Of the axes 7 to 12, which a machine without them takes as zeros.
constexpr int kExternalAxes = 6;

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t' || text.front() == '\n')) text.remove_prefix(1);
  while (!text.empty() && std::string_view(" \t\r\n").find(text.back()) != std::string_view::npos)
    text.remove_suffix(1);
  return text;
}

/// A number with so many decimals, with a point whatever the locale.
std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) throw ControllerError(ControllerFault::not_sent, "a number to be sent is not finite");
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, decimals);
  if (end.ec != std::errc()) throw ControllerError(ControllerFault::not_sent, "a number to be sent is too large");
  std::string out(text, end.ptr);
  return out.find_first_not_of("-0.") == std::string::npos && out.front() == '-' ? out.substr(1) : out;  // no -0.000
}

std::string joined(const std::vector<std::string>& fields) {
  std::string line;
  for (const std::string& field : fields) line += (line.empty() ? "" : ",") + field;
  return line;
}

void add_numbers(std::vector<std::string>& fields, const CartesianPosition& position, const Format& format) {
  for (int i = 0; i < 6; ++i) fields.push_back(fixed(position.numbers[i], i < 3 ? 3 : format.angle_decimals));
}

std::string move_data(std::vector<std::string> fields, const CartesianPosition& to, int type, const Format& format) {
  fields.push_back(std::to_string(to.frame));
  add_numbers(fields, to, format);
  fields.push_back(std::to_string(type));
  fields.push_back(std::to_string(to.tool));
  fields.insert(fields.end(), kExternalAxes, "0");
  return joined(fields);
}

std::optional<std::vector<long>> integers_of(std::string_view line) {
  const auto numbers = numbers_of(line);
  if (!numbers) return std::nullopt;
  std::vector<long> result;
  for (const double number : *numbers) {
    if (number != std::floor(number) || std::abs(number) > 4294967295.0) return std::nullopt;
    result.push_back(static_cast<long>(number));
  }
  return result;
}

bool is_whole(double number, double most) { return number == std::floor(number) && number >= 0 && number <= most; }

}  // namespace

std::string request(std::string_view command, std::string_view data) {
  const std::size_t size = data.empty() ? 0 : data.size() + 1;
  return "HOSTCTRL_REQUEST " + std::string(command) + " " + std::to_string(size) + "\r\n";
}

std::string start_request(int count) { return "CONNECT Robot_access Keep-Alive:" + std::to_string(count) + "\r\n"; }

bool is_start_answer(std::string_view line) {
  return line.starts_with("OK:") && line.find("Information Server") != std::string_view::npos;
}

Ending ending_of(std::string_view line) {
  line = trimmed(line);
  if (!line.starts_with("ERROR")) return {std::nullopt, std::string(line)};
  int number = 0;  // an error without a number is an error as well
  const std::size_t at = line.rfind('(');
  if (at != std::string_view::npos) std::from_chars(line.data() + at + 1, line.data() + line.size(), number);
  return {number, std::string(line)};
}

std::optional<std::string> accepted_command(std::string_view line) {
  if (!line.starts_with("OK:")) return std::nullopt;
  return std::string(trimmed(line.substr(3)));
}

std::string movj_data(double speed_percent, const CartesianPosition& to, const Format& format) {
  return move_data({fixed(speed_percent, 2)}, to, to.type, format);
}

std::string movl_data(double speed_mm_s, const CartesianPosition& to, const Format& format) {
  return move_data({"0", fixed(speed_mm_s, 1)}, to, to.type, format);
}

std::string imov_data(double speed_mm_s, const CartesianPosition& by, const Format& format) {
  return move_data({"0", fixed(speed_mm_s, 1)}, by, 0, format);
}

std::string pmovj_data(double speed_percent, const PulsePosition& to) {
  std::vector<std::string> fields{fixed(speed_percent, 2)};
  for (std::size_t i = 0; i < 12; ++i) fields.push_back(std::to_string(i < to.pulses.size() ? to.pulses[i] : 0));
  fields.push_back(std::to_string(to.tool));
  return joined(fields);
}

std::string wuframe_data(int frame, const CartesianPosition& org, const CartesianPosition& xx,
                         const CartesianPosition& xy, int tool, const Format& format) {
  std::vector<std::string> fields{std::to_string(frame)};
  for (const CartesianPosition* position : {&org, &xx, &xy}) {
    add_numbers(fields, *position, format);
    fields.push_back(std::to_string(position->type));
  }
  fields.push_back(std::to_string(tool));
  fields.insert(fields.end(), kExternalAxes, "0");
  return joined(fields);
}

std::string savev_data(VariableType type, int number) {
  return std::to_string(static_cast<int>(type)) + "," + std::to_string(number);
}

std::string loadv_data(VariableType type, int number, double value) {
  std::string text;
  if (type == VariableType::real) {
    if (!std::isfinite(value)) throw ControllerError(ControllerFault::not_sent, "a number to be sent is not finite");
    char digits[64];
    // A fixed number: controllers read no exponents.
    const auto end = std::to_chars(digits, digits + sizeof digits, static_cast<float>(value), std::chars_format::fixed);
    if (end.ec != std::errc()) throw ControllerError(ControllerFault::not_sent, "a number to be sent is too large");
    text.assign(digits, end.ptr);
  } else {
    text = fixed(value, 0);
  }
  return savev_data(type, number) + "," + text;
}

std::string loadv_data(int number, const PositionVariable& value, const Format& format) {
  std::vector<std::string> fields{"4", std::to_string(number)};
  if (const auto* pulses = std::get_if<PulsePosition>(&value)) {
    fields.push_back("0");
    for (const long pulse : pulses->pulses) fields.push_back(std::to_string(pulse));
    fields.push_back(std::to_string(pulses->tool));
    return joined(fields);
  }
  const auto& position = std::get<CartesianPosition>(value);
  fields.insert(fields.end(), {"1", std::to_string(position.frame)});
  add_numbers(fields, position, format);
  fields.insert(fields.end(), {std::to_string(position.type), std::to_string(position.tool)});
  return joined(fields);
}

std::optional<std::vector<double>> numbers_of(std::string_view line) {
  std::vector<double> numbers;
  line = trimmed(line);
  while (true) {
    const std::size_t comma = line.find(',');
    std::string_view field = trimmed(line.substr(0, comma));
    if (field.starts_with('+')) field.remove_prefix(1);
    double number = 0;
    const auto [end, error] =
        std::from_chars(field.data(), field.data() + field.size(), number, std::chars_format::fixed);
    if (field.empty() || error != std::errc() || end != field.data() + field.size() || !std::isfinite(number))
      return std::nullopt;
    numbers.push_back(number);
    if (comma == std::string_view::npos) return numbers;
    line.remove_prefix(comma + 1);
  }
}

std::optional<ControllerStatus> status_of(std::string_view line) {
  const auto numbers = integers_of(line);
  if (!numbers || numbers->size() != 2) return std::nullopt;
  for (const long byte : *numbers)
    if (byte < 0 || byte > 255) return std::nullopt;
  return status_from_bytes(static_cast<unsigned>((*numbers)[0]), static_cast<unsigned>((*numbers)[1]));
}

std::optional<CartesianPosition> position_of(std::string_view line, int frame) {
  const auto numbers = numbers_of(line);
  // With external axes there are six pulses more; any other count is not a position of ours.
  if (!numbers || (numbers->size() != 8 && numbers->size() != 8 + kExternalAxes)) return std::nullopt;
  if (!is_whole((*numbers)[6], 65535) || !is_whole((*numbers)[7], 63)) return std::nullopt;
  CartesianPosition position;
  position.frame = frame;
  std::copy_n(numbers->begin(), 6, position.numbers.begin());
  position.type = static_cast<int>((*numbers)[6]);
  position.tool = static_cast<int>((*numbers)[7]);
  return position;
}

std::optional<ControllerAlarms> alarms_of(std::string_view line) {
  const auto numbers = integers_of(line);
  if (!numbers || numbers->size() != 10) return std::nullopt;
  const auto alarm = [&numbers](std::size_t i) {
    return ControllerAlarm{static_cast<int>((*numbers)[i]), static_cast<int>((*numbers)[i + 1])};
  };
  ControllerAlarms alarms{alarm(0), {}};
  for (std::size_t i = 2; i < 10; i += 2)
    if (alarm(i).code != 0) alarms.alarms.push_back(alarm(i));
  return alarms;
}

std::optional<RunningJob> job_of(std::string_view line) {
  const std::size_t comma = line.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  const auto numbers = integers_of(line.substr(comma + 1));
  if (!numbers || numbers->size() != 2) return std::nullopt;
  return RunningJob{std::string(trimmed(line.substr(0, comma))), static_cast<int>((*numbers)[0]),
                    static_cast<int>((*numbers)[1])};
}

std::optional<PositionVariable> position_variable_of(std::string_view line) {
  const auto numbers = numbers_of(line);
  if (!numbers || numbers->empty()) return std::nullopt;
  const auto& n = *numbers;
  if (n[0] == 0) {
    if (n.size() < 8 || n.size() > 14) return std::nullopt;  // 6 to 12 pulses
    const auto whole = integers_of(line);
    if (!whole) return std::nullopt;
    return PulsePosition{{whole->begin() + 1, whole->end() - 1}, static_cast<int>(whole->back())};
  }
  if (n[0] != 1 || n.size() != 10 || !is_whole(n[1], 65) || !is_whole(n[8], 65535) || !is_whole(n[9], 63))
    return std::nullopt;
  CartesianPosition position;
  position.frame = static_cast<int>(n[1]);
  std::copy_n(n.begin() + 2, 6, position.numbers.begin());
  position.type = static_cast<int>(n[8]);
  position.tool = static_cast<int>(n[9]);
  return position;
}

bool is_job_name(std::string_view name) {
  return !name.empty() && name.size() <= 8 &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_") == std::string_view::npos;
}

std::optional<std::string> LineReader::next() {
  while (true) {
    const std::size_t start = buffer_.find_first_not_of('\n');  // what a CR LF left behind
    if (start == std::string::npos) {
      buffer_.clear();
      return std::nullopt;
    }
    if (start > 0) buffer_.erase(0, start);
    const std::size_t end = buffer_.find('\r');
    if (end == std::string::npos) return std::nullopt;
    std::string line = buffer_.substr(0, end);
    buffer_.erase(0, end + 1);
    if (!line.empty()) return line;
  }
}

}  // namespace tribin::robot::nx100
