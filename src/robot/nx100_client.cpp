#include <cmath>
#include <type_traits>

#include "tribin/robot/nx100.hpp"

namespace tribin::robot {
namespace {

using namespace nx100;

class Nx100Client : public Controller {
 public:
  Nx100Client(std::unique_ptr<ByteStream> stream, Clock& clock, const Nx100Options& options, ByteSink sink)
      : stream_(std::move(stream)), clock_(clock), options_(options), sink_(std::move(sink)) {}
  ~Nx100Client() override { drop(); }

  ControllerStatus status() override { return read("RSTATS", "", status_of); }
  CartesianPosition position(int frame, int arm) override {
    if (arm != 0 &&
        arm != group_) {  // a choice of the controller's, which stays; it is made anew where it may not have come
      group_ = 0;
      command("CGROUP", std::to_string(1 << (arm - 1)) + ",0");
      group_ = arm;
    }
    return read("RPOSC", std::to_string(frame) + ",0",
                [frame](std::string_view line) { return position_of(line, frame); });
  }
  PulsePosition pulses() override {
    return read("RPOSJ", "", [](std::string_view line) -> std::optional<PulsePosition> {
      const auto numbers = numbers_of(line);
      if (!numbers || numbers->size() < 6 || numbers->size() > 13) return std::nullopt;
      PulsePosition position;
      for (const double number : *numbers) position.pulses.push_back(std::lround(number));
      return position;
    });
  }
  ControllerAlarms alarms() override { return read("RALARM", "", alarms_of); }
  RunningJob running_job() override { return read("RJSEQ", "", job_of); }

  int read_byte(int number) override { return static_cast<int>(read_value(VariableType::byte, number, 0, 255)); }
  int read_integer(int number) override {
    return static_cast<int>(read_value(VariableType::integer, number, -32768, 32767));
  }
  long read_double(int number) override {
    return static_cast<long>(read_value(VariableType::double_integer, number, -2147483648.0, 2147483647.0));
  }
  double read_real(int number) override { return read_value(VariableType::real, number, -1e39, 1e39); }
  PositionVariable read_position(int number) override {
    return read("SAVEV", savev_data(VariableType::position, number), position_variable_of);
  }

  void write_byte(int number, int value) override { write_value(VariableType::byte, number, value, 0, 255); }
  void write_integer(int number, int value) override {
    write_value(VariableType::integer, number, value, -32768, 32767);
  }
  void write_double(int number, long value) override {
    write_value(VariableType::double_integer, number, static_cast<double>(value), -2147483648.0, 2147483647.0);
  }
  void write_real(int number, double value) override { write_value(VariableType::real, number, value, -3e38, 3e38); }
  void write_position(int number, const PositionVariable& value) override {
    command("LOADV", loadv_data(number, value, options_.format));
  }
  double angle_step_deg() const override { return std::pow(10.0, -options_.format.angle_decimals); }

  void hold(bool on) override {
    if (!on) return command("HOLD", "0");
    // To stop twice does no harm: it is repeated like what reads.
    for (int attempt = 1;; ++attempt) try {
        return command("HOLD", "1");
      } catch (const ControllerError& error) {
        if (error.fault() == ControllerFault::refused || attempt >= options_.read_attempts) throw;
      }
  }
  void start_job(const std::string& name) override {
    if (!name.empty() && !is_job_name(name))
      throw ControllerError(ControllerFault::not_sent,
                            "saw the job name '" + name + "', wanted at most 8 of A-Z 0-9 - _");
    command("START", name, options_.start_timeout_s);
  }

  void set_servo(bool on, const OperatorToken&) override { command("SVON", on ? "1" : "0"); }
  void reset_alarm(const OperatorToken&) override { command("RESET", ""); }
  void cancel_error(const OperatorToken&) override { command("CANCEL", ""); }
  void set_play_mode(bool play, const OperatorToken&) override { command("MODE", play ? "2" : "1"); }
  void delete_job(const std::string& name, const OperatorToken&) override {
    if (!is_job_name(name))
      throw ControllerError(ControllerFault::not_sent, "saw '" + name + "' to be deleted, wanted the name of one job");
    command("DELETE", name);
  }

 private:
  void log(LinkEvent event, std::string_view bytes) {
    if (sink_) sink_(event, clock_.now_s(), bytes);
  }

  void drop() {
    if (!open_) return;
    stream_->close();
    open_ = false;
    log(LinkEvent::closed, {});
  }

  [[noreturn]] void fail(ControllerFault fault, const std::string& message) {
    drop();
    throw ControllerError(fault, message);
  }

  bool send(const std::string& bytes) {
    log(LinkEvent::sent, bytes);
    return stream_->send(bytes);
  }

  /// The next line; none where the time is over, the connection gone or the line endless.
  std::optional<std::string> line(double timeout_s) {
    const double until = clock_.now_s() + timeout_s;
    while (true) {
      if (auto next = reader_.next()) return next;
      if (reader_.overlong()) return std::nullopt;
      const double left = until - clock_.now_s();
      if (left <= 0) return std::nullopt;
      const ByteStream::Received received = stream_->receive(left);
      if (!received.bytes.empty()) log(LinkEvent::received, received.bytes);
      if (received.closed) return std::nullopt;
      reader_.add(received.bytes);
    }
  }

  void connect() {
    if (open_) return;
    reader_.clear();
    try {
      stream_->open(options_.connect_timeout_s);
    } catch (const Error& error) {
      throw ControllerError(ControllerFault::not_sent, error.what());
    }
    open_ = true;
    log(LinkEvent::opened, {});
    if (!send(start_request(-1))) fail(ControllerFault::not_sent, "the controller closed the connection");
    const auto answer = line(options_.answer_timeout_s);
    if (!answer) fail(ControllerFault::not_sent, "the controller does not answer the start request");
    if (!is_start_answer(*answer))
      fail(ControllerFault::not_sent, "saw '" + answer->substr(0, 80) + "', wanted OK: ... Information Server");
  }

  /// One exchange. What fails before anything could be taken is `not_sent`.
  std::string exchange(const char* name, const std::string& data, double timeout_s) {
    connect();
    const bool with_data = !data.empty();
    // A command with data is not taken before its data; one without from its first byte on may be.
    const ControllerFault early = with_data ? ControllerFault::not_sent : ControllerFault::unknown_outcome;
    if (!send(request(name, data))) fail(early, std::string(name) + ": the connection is gone");
    const auto ok = line(timeout_s);
    if (!ok) fail(early, std::string(name) + ": no answer");
    if (ok->starts_with("NG")) {
      drop();
      throw ControllerError(ControllerFault::refused, std::string(name) + ": " + ok->substr(0, 80));
    }
    if (accepted_command(*ok) != name)
      fail(early, "saw '" + ok->substr(0, 80) + "', wanted OK: " + name + ": out of step");
    if (with_data && !send(data + "\r"))
      fail(ControllerFault::unknown_outcome, std::string(name) + ": the connection is gone");
    const auto answer = line(timeout_s);
    if (!answer) fail(ControllerFault::unknown_outcome, std::string(name) + ": accepted, but no answer");
    const Ending ending = ending_of(*answer);
    if (ending.error)
      throw ControllerError(
          ControllerFault::refused,
          std::string(name) + ": " + message_of(*ending.error) + " (" + std::to_string(*ending.error) + ")",
          *ending.error);
    return ending.data;
  }

  template <class Parse>
  typename std::invoke_result_t<Parse, std::string_view>::value_type read(const char* name, const std::string& data,
                                                                          Parse parse) {
    for (int attempt = 1;; ++attempt) {
      try {
        const std::string answer = exchange(name, data, options_.answer_timeout_s);
        if (auto value = parse(std::string_view(answer))) return *value;
        fail(ControllerFault::bad_answer, std::string(name) + ": saw '" + answer.substr(0, 80) + "'");
      } catch (const ControllerError& error) {
        // NG is no number of the interpreter: the session was refused, not the command.
        if ((error.fault() == ControllerFault::refused && error.number() != 0) || attempt >= options_.read_attempts)
          throw;
      }
    }
  }

  double read_value(VariableType type, int number, double least, double most) {
    return read("SAVEV", savev_data(type, number), [=](std::string_view line) -> std::optional<double> {
      const auto numbers = numbers_of(line);
      if (!numbers || numbers->size() != 1 || (*numbers)[0] < least || (*numbers)[0] > most) return std::nullopt;
      if (type != VariableType::real && (*numbers)[0] != std::floor((*numbers)[0])) return std::nullopt;
      return (*numbers)[0];
    });
  }

  void write_value(VariableType type, int number, double value, double least, double most) {
    if (!(value >= least && value <= most))
      throw ControllerError(ControllerFault::not_sent,
                            "a value for variable " + std::to_string(number) + " is out of its range");
    command("LOADV", loadv_data(type, number, value));
  }

  void command(const char* name, const std::string& data) { command(name, data, options_.answer_timeout_s); }

  void command(const char* name, const std::string& data, double timeout_s) {
    std::string answer;
    try {
      answer = exchange(name, data, timeout_s);
    } catch (const ControllerError& error) {
      // A kept connection may have been closed while it was idle: what was not taken goes out once more, on a new one.
      if (error.fault() != ControllerFault::not_sent) throw;
      answer = exchange(name, data, timeout_s);
    }
    if (answer != "0000")
      fail(ControllerFault::unknown_outcome, std::string(name) + ": saw '" + answer.substr(0, 80) + "', wanted 0000");
  }

  int group_ = 0;  ///< arm that this client asked positions of; 0 = not known: the choice outlives a client
  std::unique_ptr<ByteStream> stream_;
  Clock& clock_;
  Nx100Options options_;
  ByteSink sink_;
  LineReader reader_;
  bool open_ = false;
};

}  // namespace

std::unique_ptr<Controller> make_nx100(std::unique_ptr<ByteStream> stream, Clock& clock, const Nx100Options& options,
                                       ByteSink sink) {
  return std::make_unique<Nx100Client>(std::move(stream), clock, options, std::move(sink));
}

}  // namespace tribin::robot
