#include "tribin/controller_sim/inform.hpp"

#include <charconv>
#include <cmath>

#include "tribin/core/error.hpp"

namespace tribin::controller_sim {
namespace {

using robot::CartesianPosition;
using robot::PositionVariable;
using robot::PulsePosition;

class JobReader {
 public:
  JobReader(std::string_view text, std::string where) : text_(text), where_(std::move(where)) {}

  Job read() {
    if (next_line() != "/JOB") fail("/JOB as the first line");
    while (true) {
      const std::string_view line = next_line();
      if (at_end_) fail("//INST and the instructions behind it");
      if (line == "//INST") break;
      header_line(line);
    }
    instructions();
    check_jumps();
    if (job_.name.empty()) fail("a line //NAME");
    return std::move(job_);
  }

 private:
  [[noreturn]] void fail(const std::string& wanted) const {
    throw Error(ErrorCode::bad_input, where_ + ", line " + std::to_string(number_) + ": saw '" +
                                          std::string(line_.substr(0, 60)) + "', wanted " + wanted);
  }

  std::string_view next_line() {
    if (text_.empty()) {
      at_end_ = true;
      return line_ = {};
    }
    const std::size_t end = text_.find('\n');
    line_ = text_.substr(0, end);
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    while (!line_.empty() && (line_.back() == '\r' || line_.back() == ' ')) line_.remove_suffix(1);
    ++number_;
    return line_;
  }

  static bool take(std::string_view& text, std::string_view prefix) {
    if (!text.starts_with(prefix)) return false;
    text.remove_prefix(prefix.size());
    return true;
  }

  /// The next word, up to a blank; blanks before it are dropped.
  static std::string_view word(std::string_view& text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    const std::string_view result = text.substr(0, text.find(' '));
    text.remove_prefix(result.size());
    return result;
  }

  double number(std::string_view text) const {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
    if (text.empty() || error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
      fail("a number in place of '" + std::string(text) + "'");
    return value;
  }
  int whole(std::string_view text) const {
    const double value = number(text);
    if (value != std::floor(value) || std::abs(value) > 1e9)
      fail("a whole number in place of '" + std::string(text) + "'");
    return static_cast<int>(value);
  }

  void header_line(std::string_view line) {
    if (take(line, "//NAME ")) {
      job_.name = line;
    } else if (take(line, "///TOOL ")) {
      tool_ = whole(line);
    } else if (take(line, "///POSTYPE ")) {
      if (line != "ROBOT" && line != "BASE" && line != "PULSE") fail("///POSTYPE ROBOT, BASE or PULSE");
      frame_ = line == "BASE" ? 0 : 1;
    } else if (line == "///RECTAN" || line == "///PULSE") {
      pulses_ = line == "///PULSE";
    } else if (take(line, "///RCONF ")) {
      form_of(line);
    } else if (line.starts_with("C") || line.starts_with("P")) {
      position_line(line);
    } else if (!line.starts_with("//") && !line.empty()) {
      fail("a line of the header");
    }
  }

  void form_of(std::string_view line) {
    form_ = 0;
    for (int bit = 0; bit < 6; ++bit) {
      const std::size_t comma = line.find(',');
      form_ |= (whole(line.substr(0, comma)) != 0) << bit;
      if (comma == std::string_view::npos) return;
      line.remove_prefix(comma + 1);
    }
  }

  void position_line(std::string_view line) {
    const bool taught = line.front() == 'P';
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) fail("C00000=... or P00000=...");
    const int index = whole(line.substr(1, equals - 1));
    line.remove_prefix(equals + 1);
    std::vector<double> values;
    while (true) {
      const std::size_t comma = line.find(',');
      values.push_back(number(line.substr(0, comma)));
      if (comma == std::string_view::npos) break;
      line.remove_prefix(comma + 1);
    }
    PositionVariable position;
    if (pulses_) {
      PulsePosition pulses{{}, tool_};
      for (const double value : values) pulses.pulses.push_back(std::lround(value));
      position = pulses;
    } else {
      if (values.size() != 6 && values.size() != 7) fail("6 numbers, or 7 with Re");
      CartesianPosition cartesian;
      cartesian.frame = frame_;
      std::copy_n(values.begin(), 6, cartesian.numbers.begin());
      cartesian.elbow_deg = values.size() == 7 ? values[6] : 0;
      cartesian.type = form_;
      cartesian.tool = tool_;
      position = cartesian;
    }
    (taught ? job_.taught : job_.positions)[index] = position;
  }

  void instructions() {
    bool begun = false, ended = false;
    while (!ended) {
      const std::string_view line = next_line();
      if (at_end_) fail("END");
      if (line.empty() || line.front() == '\'' || line.starts_with("///")) continue;
      if (!begun && line != "NOP") fail("NOP as the first instruction");
      begun = true;
      Instruction instruction = instruction_of(line);
      instruction.line = static_cast<int>(job_.instructions.size());
      if (instruction.operation == Operation::label && !job_.labels.emplace(instruction.text, instruction.line).second)
        fail("a label that is not there yet");
      ended = instruction.operation == Operation::end;
      job_.instructions.push_back(std::move(instruction));
    }
  }

  void check_jumps() const {
    for (const Instruction& instruction : job_.instructions)
      if (instruction.operation == Operation::jump && !job_.labels.count(instruction.text))
        throw Error(ErrorCode::bad_input, where_ + ": saw JUMP *" + instruction.text + ", wanted a label of the job");
  }

  /// "IN#(5)" -> 5
  int io_number(std::string_view text, std::string_view kind) const {
    if (!text.starts_with(kind) || text.size() < kind.size() + 4 || text.substr(kind.size(), 2) != "#(" ||
        text.back() != ')')
      fail(std::string(kind) + "#(number)");
    return whole(text.substr(kind.size() + 2, text.size() - kind.size() - 3));
  }

  Operand operand(std::string_view text) const {
    if (text.empty()) fail("a variable or a number");
    const char kind = text.front();
    if (kind == 'B' || kind == 'I' || kind == 'D' || kind == 'R') return {kind, whole(text.substr(1)), 0};
    return {'#', 0, number(text)};
  }

  Operand variable(std::string_view text) const {
    const Operand result = operand(text);
    if (result.kind == '#') fail("a variable B, I, D or R");
    return result;
  }

  Condition condition(std::string_view text) const {
    Condition result;
    if (text.starts_with("IN#")) {
      const std::size_t equals = text.find('=');
      const std::string_view state = equals == std::string_view::npos ? "" : text.substr(equals + 1);
      if (state != "ON" && state != "OFF") fail("IN#(number)=ON or OFF");
      result.input = true;
      result.input_number = io_number(text.substr(0, equals), "IN");
      result.on = state == "ON";
      return result;
    }
    constexpr std::pair<std::string_view, Comparison> kSigns[] = {
        {"<>", Comparison::not_equal}, {"<=", Comparison::less_equal}, {">=", Comparison::greater_equal},
        {"=", Comparison::equal},      {"<", Comparison::less},        {">", Comparison::greater}};
    for (const auto& [sign, comparison] : kSigns) {
      const std::size_t at = text.find(sign);
      if (at == std::string_view::npos) continue;
      result.left = operand(text.substr(0, at));
      result.right = operand(text.substr(at + sign.size()));
      result.comparison = comparison;
      return result;
    }
    fail("a comparison, as B000=1");
  }

  std::optional<Condition> optional_condition(std::string_view rest) const {
    const std::string_view keyword = word(rest);
    if (keyword.empty()) return std::nullopt;
    if (keyword != "IF") fail("IF and a condition");
    return condition(word(rest));
  }

  /// "VJ=20.00", "V=100.0", "T=0.05"
  std::optional<double> setting(std::string_view rest, std::string_view key) const {
    while (true) {
      const std::string_view next = word(rest);
      if (next.empty()) return std::nullopt;
      if (next.starts_with(key) && next.substr(key.size()).starts_with('=')) return number(next.substr(key.size() + 1));
    }
  }

  Instruction instruction_of(std::string_view line) const {
    Instruction result;
    if (line.front() == '*') {
      result.operation = Operation::label;
      result.text = line.substr(1);
      return result;
    }
    std::string_view rest = line;
    const std::string_view name = word(rest);
    if (name == "NOP") return result;
    if (name == "MOVJ" || name == "MOVL" || name == "IMOV") return move(name, rest);
    if (name == "SET" || name == "ADD" || name == "SUB") {
      result.operation = name == "SET" ? Operation::set : name == "ADD" ? Operation::add : Operation::sub;
      result.target = variable(word(rest));
      result.value = operand(word(rest));
    } else if (name == "INC" || name == "DEC") {
      result.operation = name == "INC" ? Operation::inc : Operation::dec;
      result.target = variable(word(rest));
    } else if (name == "TIMER") {
      result.operation = Operation::timer;
      result.seconds = setting(rest, "T").value_or(-1);
      if (result.seconds < 0) fail("TIMER T=seconds");
    } else if (name == "JUMP") {
      result.operation = Operation::jump;
      const std::string_view label = word(rest);
      if (!label.starts_with('*')) fail("JUMP *LABEL");
      result.text = label.substr(1);
      result.condition = optional_condition(rest);
    } else if (name == "CALL") {
      result.operation = Operation::call;
      std::string_view job = word(rest);
      if (!take(job, "JOB:")) fail("CALL JOB:NAME");
      result.text = job;
      result.condition = optional_condition(rest);
    } else if (name == "DOUT") {
      result.operation = Operation::dout;
      result.io = io_number(word(rest), "OT");
      const std::string_view state = word(rest);
      if (state != "ON" && state != "OFF") fail("DOUT OT#(number) ON or OFF");
      result.on = state == "ON";
    } else if (name == "WAIT") {
      result.operation = Operation::wait_input;
      result.condition = condition(word(rest));
      result.seconds = setting(rest, "T").value_or(-1);
    } else if (name == "MSG") {
      result.operation = Operation::message;
      result.text = rest.substr(std::min(rest.size(), rest.find('"')));
    } else if (name == "RET" || name == "PAUSE" || name == "ABORT" || name == "END") {
      result.operation = name == "RET"     ? Operation::ret
                         : name == "PAUSE" ? Operation::pause
                         : name == "ABORT" ? Operation::abort_job
                                           : Operation::end;
    } else {
      fail(
          "an instruction that the interpreter knows (NOP MOVJ MOVL IMOV SET ADD SUB INC DEC TIMER JUMP CALL RET DOUT "
          "WAIT MSG PAUSE ABORT END *LABEL)");
    }
    return result;
  }

  Instruction move(std::string_view name, std::string_view rest) const {
    Instruction result;
    result.operation = name == "MOVJ" ? Operation::movj : name == "MOVL" ? Operation::movl : Operation::imov;
    const std::string_view position = word(rest);
    if (position.size() < 2 || (position.front() != 'C' && position.front() != 'P'))
      fail("a position, as P001 or C00000");
    result.position = position.front();
    result.position_index = whole(position.substr(1));
    result.speed = setting(rest, name == "MOVJ" ? "VJ" : "V").value_or(0);
    if (!(result.speed > 0)) fail(name == "MOVJ" ? "VJ=percent" : "V=mm/s");
    return result;
  }

  std::string_view text_, line_;
  std::string where_;
  int number_ = 0, tool_ = 0, frame_ = 1, form_ = 0;
  bool at_end_ = false, pulses_ = false;
  Job job_;
};

}  // namespace

Job parse_job(std::string_view text, const std::string& where) { return JobReader(text, where).read(); }

}  // namespace tribin::controller_sim
