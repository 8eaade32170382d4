#include <algorithm>
#include <cstdio>
#include <cstring>

#include "tribin/robot/hses.hpp"

namespace tribin::robot {
namespace {

using namespace hses;

std::string hex_text(unsigned value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%X", value);
  return text;
}

std::string text_of(std::string_view field) { return std::string(field.substr(0, field.find('\0'))); }

std::string padded(const std::string& name, std::size_t size) {
  std::string out = name;
  out.resize(size, '\0');
  return out;
}

std::string word(std::int64_t value) {
  std::string data;
  put32(data, value);
  return data;
}

class HsesClient : public Controller {
 public:
  HsesClient(std::unique_ptr<DatagramLink> link, Clock& clock, const HsesOptions& options, ByteSink sink,
             std::unique_ptr<DatagramLink> files)
      : link_(std::move(link)), files_(std::move(files)), clock_(clock), options_(options), sink_(std::move(sink)) {}

  ControllerStatus status() override {
    const std::string data = read(0x72, 1, 0, 8);
    return status_from_bytes(static_cast<unsigned>(get32(data, 0)) & 255, static_cast<unsigned>(get32(data, 1)) & 255);
  }
  CartesianPosition position(int frame, int arm) override {
    if (frame != 1)
      throw ControllerError(ControllerFault::not_sent, "only frame 1 (robot) can be read over this protocol");
    const auto position = position_of(read(0x75, arm == 2 ? 102 : 101, 0, 52));
    if (!position || position->index() != 0) bad("position");
    return std::get<CartesianPosition>(*position);
  }
  PulsePosition pulses() override {
    const auto position = position_of(read(0x75, 1, 0, 52));
    if (!position || position->index() != 1) bad("pulses");
    return std::get<PulsePosition>(*position);
  }
  ControllerAlarms alarms() override {
    ControllerAlarms alarms;
    for (int i = 1; i <= 4; ++i) {
      const std::string data = read(0x70, i, 0, 0);
      // An empty place is answered by zeros, or by an error of the element.
      if (data.size() >= 8 && get32(data, 0) != 0) alarms.alarms.push_back({get32(data, 0), get32(data, 1)});
    }
    return alarms;
  }
  RunningJob running_job() override {
    const std::string data = read(0x73, 1, 0, 44);
    return {text_of(std::string_view(data).substr(0, 32)), get32(data, 8), get32(data, 9)};
  }

  int read_byte(int number) override { return static_cast<unsigned char>(read(0x7A, number, 1, 1)[0]); }
  int read_integer(int number) override {
    const std::string data = read(0x7B, number, 1, 2);
    return static_cast<std::int16_t>(static_cast<unsigned char>(data[0]) | static_cast<unsigned char>(data[1]) << 8);
  }
  long read_double(int number) override { return get32(read(0x7C, number, 1, 4), 0); }
  double read_real(int number) override {
    const std::int32_t bits = get32(read(0x7D, number, 1, 4), 0);
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  PositionVariable read_position(int number) override {
    const auto position = position_of(read(0x7F, number, 0, 52));
    if (!position) bad("P variable");
    return *position;
  }

  void write_byte(int number, int value) override {
    in_range(value, 0, 255);
    write(0x7A, number, 1, Service::set_one, std::string(1, static_cast<char>(value)));
  }
  void write_integer(int number, int value) override {
    in_range(value, -32768, 32767);
    write(0x7B, number, 1, Service::set_one, word(value).substr(0, 2));
  }
  void write_double(int number, long value) override {
    in_range(value, -2147483648L, 2147483647L);
    write(0x7C, number, 1, Service::set_one, word(value));
  }
  void write_real(int number, double value) override {
    if (!(std::abs(value) < 3e38))
      throw ControllerError(ControllerFault::not_sent, "a number to be sent is not finite");
    const auto real = static_cast<float>(value);
    std::int32_t bits;
    std::memcpy(&bits, &real, sizeof bits);
    write(0x7D, number, 1, Service::set_one, word(bits));
  }
  void write_position(int number, const PositionVariable& value) override {
    write(0x7F, number, 0, Service::set_all, position_data(value));
  }
  double angle_step_deg() const override { return 1e-4; }

  void hold(bool on) override {
    const std::string data = word(on ? 1 : 2);
    if (!on) return write(0x83, 1, 1, Service::set_one, data);
    for (int attempt = 1;; ++attempt) try {  // to stop twice does no harm
        return write(0x83, 1, 1, Service::set_one, data);
      } catch (const ControllerError& error) {
        if (error.fault() == ControllerFault::refused || attempt >= options_.read_attempts) throw;
      }
  }
  void start_job(const std::string& name) override {
    if (!name.empty()) {
      if (name.size() > 32) throw ControllerError(ControllerFault::not_sent, "a job's name has at most 32 characters");
      write(0x87, 1, 0, Service::set_all, padded(name, 32) + word(0));
    }
    write(0x86, 1, 1, Service::set_one, word(1));
  }

  void set_servo(bool on, const OperatorToken&) override { write(0x83, 2, 1, Service::set_one, word(on ? 1 : 2)); }
  void reset_alarm(const OperatorToken&) override { write(0x82, 1, 1, Service::set_one, word(1)); }
  void cancel_error(const OperatorToken&) override { write(0x82, 2, 1, Service::set_one, word(1)); }
  void set_play_mode(bool, const OperatorToken&) override {
    throw ControllerError(ControllerFault::not_sent, "this protocol has no command for the mode: use the key switch");
  }
  void delete_job(const std::string& name, const OperatorToken&) override {
    if (name.empty() || name.find('*') != std::string::npos || name.size() > 32)
      throw ControllerError(ControllerFault::not_sent, "saw '" + name + "' to be deleted, wanted the name of one job");
    if (!files_) throw ControllerError(ControllerFault::not_sent, "no link to the port of files");
    Request request;
    request.division = Division::file;
    request.service = Service::file_delete;
    request.data = name + ".JBI";
    checked(exchange(*files_, request), request);
  }

 private:
  [[noreturn]] static void bad(const std::string& what) {
    throw ControllerError(ControllerFault::bad_answer, what + ": the answer is none of this protocol");
  }
  static void in_range(long value, long least, long most) {
    if (value < least || value > most)
      throw ControllerError(ControllerFault::not_sent, "a value to be sent is out of its range");
  }

  /// Sends once and waits for the packet of its number; others are old ones that come late.
  std::optional<Answer> exchange(DatagramLink& link, Request& request) {
    request.id = ++id_;
    const std::string bytes = bytes_of(request);
    if (sink_) sink_(LinkEvent::sent, clock_.now_s(), bytes);
    link.send(bytes);
    const double until = clock_.now_s() + options_.answer_timeout_s;
    while (true) {
      const double left = until - clock_.now_s();
      if (left <= 0) return std::nullopt;
      const std::string received = link.receive(left);
      if (received.empty()) continue;
      if (sink_) sink_(LinkEvent::received, clock_.now_s(), received);
      const auto answer = answer_of(received);
      if (answer && answer->id == request.id && answer->division == request.division &&
          answer->service == static_cast<std::uint8_t>(request.service))
        return answer;
    }
  }

  static std::string checked(const std::optional<Answer>& answer, const Request& request) {
    const std::string name = "command " + hex_text(request.command);
    if (!answer) throw ControllerError(ControllerFault::unknown_outcome, name + ": no answer");
    if (answer->status != 0) {
      const int number = decimal_digits(answer->added);
      throw ControllerError(ControllerFault::refused,
                            name + ": " + message_of(number) + " (status " + hex_text(answer->status) + ", " +
                                hex_text(answer->added) + ")",
                            number);
    }
    return answer->data;
  }

  /// \param size  wanted of the data; 0 = any
  std::string read(std::uint16_t command, int instance, std::uint8_t attribute, std::size_t size) {
    Request request;
    request.command = command;
    request.instance = static_cast<std::uint16_t>(instance);
    request.attribute = attribute;
    request.service = attribute == 0 ? Service::get_all : Service::get_one;
    for (int attempt = 1;; ++attempt) {
      const auto answer = exchange(*link_, request);
      // Neither a loss nor trouble of the protocol itself (busy, ...) is the controller's word on what was asked.
      const bool no_word = !answer || (answer->status != 0 && decimal_digits(answer->added) == 0);
      if (no_word && attempt < options_.read_attempts) continue;
      if (!answer) throw ControllerError(ControllerFault::not_sent, "command " + hex_text(command) + ": no answer");
      const std::string data = checked(answer, request);
      if (size == 0 || data.size() == size) return data;
      if (attempt >= options_.read_attempts) bad("command " + hex_text(command));
    }
  }

  void write(std::uint16_t command, int instance, std::uint8_t attribute, Service service, const std::string& data) {
    Request request;
    request.command = command;
    request.instance = static_cast<std::uint16_t>(instance);
    request.attribute = attribute;
    request.service = service;
    request.data = data;
    checked(exchange(*link_, request), request);
  }

  std::unique_ptr<DatagramLink> link_, files_;
  Clock& clock_;
  HsesOptions options_;
  ByteSink sink_;
  std::uint8_t id_ = 0;
};

}  // namespace

std::unique_ptr<Controller> make_hses(std::unique_ptr<DatagramLink> link, Clock& clock, const HsesOptions& options,
                                      ByteSink sink, std::unique_ptr<DatagramLink> files) {
  return std::make_unique<HsesClient>(std::move(link), clock, options, std::move(sink), std::move(files));
}

}  // namespace tribin::robot
