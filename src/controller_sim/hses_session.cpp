#include <cmath>
#include <cstring>

#include "tribin/controller_sim/sessions.hpp"
#include "tribin/robot/hses.hpp"

namespace tribin::controller_sim {
namespace {

using namespace robot::hses;

// Status bytes: command undefined, element wrong, refused with a message number.
constexpr std::uint8_t kNoCommand = 0x08, kNoElement = 0x09, kRefused = 0x1F;

struct Outcome {
  std::uint8_t status = 0;
  int number = 0;
  std::string data;
};

Outcome of_number(int number) { return number == 0 ? Outcome{} : Outcome{kRefused, number, {}}; }
Outcome of_data(std::string data) { return {0, 0, std::move(data)}; }

std::string words(std::initializer_list<long> values) {
  std::string data;
  for (const long value : values) put32(data, value);
  return data;
}

std::string name_field(const std::string& name) {
  std::string data = name.substr(0, 32);
  data.resize(32, '\0');
  return data;
}

bool is_read(const Request& r) { return r.service == Service::get_one || r.service == Service::get_all; }
bool is_write(const Request& r) { return r.service == Service::set_one || r.service == Service::set_all; }

/// A variable of a number's kind, there and back.
template <class Map, class Encode, class Decode>
Outcome variable(Machine& machine, const Request& r, Map& map, std::size_t size, Encode encode, Decode decode) {
  if (r.instance > 99) return {kNoElement, 0, {}};
  if (is_read(r)) {
    const auto at = map.find(r.instance);
    return of_data(encode(at == map.end() ? typename Map::mapped_type{} : at->second));
  }
  if (const int number = machine.check_ready(false)) return of_number(number);
  if (r.data.size() != size) return {kNoElement, 0, {}};
  map[r.instance] = decode(r.data);
  return {};
}

Outcome position_variable(Machine& machine, const Request& r) {
  if (r.instance > 127) return {kNoElement, 0, {}};
  if (is_read(r)) {
    const auto at = machine.positions.find(r.instance);
    return at == machine.positions.end() ? of_number(4130) : of_data(position_data(at->second));
  }
  if (const int number = machine.check_ready(false)) return of_number(number);
  const auto position = position_of(r.data);
  if (!position) return {kNoElement, 0, {}};
  machine.positions[r.instance] = *position;
  return {};
}

Outcome where(const Machine& machine, const Request& r) {
  if (r.instance == 1) return of_data(position_data(robot::PulsePosition{machine.pulses(), 0}));
  if (r.instance > 100 && r.instance <= 100 + machine.arms())
    return of_data(position_data(machine.position(r.instance - 100)));
  return {kNoElement, 0, {}};
}

Outcome alarm(const Machine& machine, const Request& r) {
  if (r.instance < 1 || r.instance > 4) return {kNoElement, 0, {}};
  const std::size_t index = r.instance - 1u;
  robot::ControllerAlarm found;
  if (index < machine.alarm_list.size()) found = machine.alarm_list[index];
  std::string data = words({found.code, found.data, 0});
  data.resize(12 + 16 + 32, '\0');
  return of_data(data);
}

Outcome switches(Machine& machine, const Request& r) {
  if (r.data.size() != 4) return {kNoElement, 0, {}};
  const int value = get32(r.data, 0);
  if (value != 1 && value != 2) return {kNoElement, 0, {}};
  if (r.instance == 1) return of_number(machine.hold(value == 1));
  if (r.instance == 2) return of_number(machine.servo(value == 1));
  return r.instance == 3 ? Outcome{} : Outcome{kNoElement, 0, {}};
}

Outcome select(Machine& machine, const Request& r) {
  if (r.data.size() != 36) return {kNoElement, 0, {}};
  const std::string name(r.data.data(), strnlen(r.data.data(), 32));
  return of_number(machine.select(name, get32(r.data, 8)));
}

/// 104 bytes, as hses::move_data writes them.
Outcome move(Machine& machine, const Request& r) {
  if (r.data.size() != 104 || r.instance < 1 || r.instance > 3) return {kNoElement, 0, {}};
  if (const int number = machine.check_ready(true)) return of_number(number);
  const int speed_class = get32(r.data, 2), frame = get32(r.data, 4);
  if ((frame != 16 && frame != 17) || speed_class < 0 || speed_class > 2 || get32(r.data, 3) <= 0)
    return of_number(1012);
  robot::CartesianPosition to;
  to.frame = frame - 16;
  for (int i = 0; i < 6; ++i) to.numbers[i] = get32(r.data, 5 + i) / (i < 3 ? 1000.0 : 10000.0);
  to.type = form_bits_of(get32(r.data, 13));
  to.tool = get32(r.data, 15);
  const double speed = speed_class == 0 ? get32(r.data, 3) * 1e-4 * 1500 : get32(r.data, 3) * 0.1;
  return of_number(machine.move(to, speed, r.instance == 3));
}

Outcome command_of(Machine& m, const Request& r) {
  const auto small = [&r](int index) { return static_cast<unsigned char>(r.data[index]); };
  switch (r.command) {
    case 0x70:
      return alarm(m, r);
    case 0x72: {
      const auto bytes = robot::bytes_from_status(m.status());
      return of_data(words({static_cast<long>(bytes[0]), static_cast<long>(bytes[1])}));
    }
    case 0x73: {
      const robot::RunningJob job = m.running_job();
      return of_data(name_field(job.name) + words({job.line, job.step, 0}));
    }
    case 0x75:
      return where(m, r);
    case 0x7A:
      return variable(
          m, r, m.bytes, 1, [](int v) { return std::string(1, static_cast<char>(v)); },
          [&](const std::string&) { return static_cast<int>(small(0)); });
    case 0x7B:
      return variable(
          m, r, m.integers, 2, [](int v) { return words({v}).substr(0, 2); },
          [&](const std::string&) { return static_cast<int>(static_cast<std::int16_t>(small(0) | small(1) << 8)); });
    case 0x7C:
      return variable(
          m, r, m.doubles, 4, [](long v) { return words({v}); },
          [](const std::string& d) { return long{get32(d, 0)}; });
    case 0x7D:
      return variable(
          m, r, m.reals, 4,
          [](double v) {
            const auto real = static_cast<float>(v);
            std::int32_t bits;
            std::memcpy(&bits, &real, sizeof bits);
            return words({bits});
          },
          [](const std::string& d) {
            const std::int32_t bits = get32(d, 0);
            float real;
            std::memcpy(&real, &bits, sizeof real);
            return std::isfinite(real) ? static_cast<double>(real) : 0.0;
          });
    case 0x7F:
      return position_variable(m, r);
    default:
      break;
  }
  if (r.command < 0x82 || r.command > 0x8A) return {kNoCommand, 0, {}};
  if (!is_write(r)) return {kNoElement, 0, {}};
  if (r.command != 0x86 && r.command != 0x8A)
    if (const int number = m.check_ready(false)) return of_number(number);
  switch (r.command) {
    case 0x82:
      return r.instance == 1   ? of_number(m.reset())
             : r.instance == 2 ? of_number(m.cancel())
                               : Outcome{kNoElement, 0, {}};
    case 0x83:
      return switches(m, r);
    case 0x84:
      if (r.data.size() != 4 || get32(r.data, 0) < 1 || get32(r.data, 0) > 3) return {kNoElement, 0, {}};
      m.cycle_mode = get32(r.data, 0);
      return {};
    case 0x85:
      m.pendant_text = r.data.substr(0, 30);
      return {};
    case 0x86:
      return of_number(m.start(""));
    case 0x87:
      return select(m, r);
    case 0x8A:
      return move(m, r);
    default:
      return {kNoCommand, 0, {}};
  }
}

/// Files: a list of names and the deleting of a job. Transfers are not simulated.
Outcome file_of(Machine& machine, const Request& r) {
  if (r.service == Service::file_delete) {
    std::string name = r.data.substr(0, r.data.find('\0'));
    if (name.ends_with(".JBI")) name.resize(name.size() - 4);
    return of_number(machine.delete_job(name));
  }
  if (r.service == Service::file_list) {
    std::string list;
    for (const std::string& name : machine.job_names()) list += name + ".JBI\r\n";
    return of_data(list.substr(0, kLargestData));
  }
  return {kNoCommand, 0, {}};
}

}  // namespace

std::vector<Chunk> hses_answer(Wire& wire, std::string_view packet, bool file_port) {
  const std::optional<Request> request = request_of(packet);
  // An answer, or an acknowledgement of a block that was never sent, is not answered: no two programs talk for ever.
  if (!request || request->acknowledges || (request->division == Division::file) != file_port) return {};
  const std::optional<Fault> fault = wire.dice.throw_dice();
  if (fault == Fault::drop_before) return {};
  Outcome outcome;
  if (fault == Fault::ng)
    outcome = {kRefused, 0, {}};
  else
    outcome = file_port ? file_of(wire.machine, *request) : command_of(wire.machine, *request);
  ++wire.commands;
  if (fault == Fault::drop_after) return {};
  Answer answer;
  answer.division = request->division;
  answer.id = request->id;
  answer.block = file_port ? 0x80000001u : 0;  // the only block, and so the last one
  answer.service = static_cast<std::uint8_t>(request->service);
  answer.status = outcome.status;
  answer.added = static_cast<std::uint16_t>(hex_digits(outcome.number));
  answer.data = outcome.data;
  std::string bytes = bytes_of(answer);
  const double now = wire.machine.now_s();
  if (fault == Fault::wrong_count) bytes.resize(bytes.size() - std::min<std::size_t>(bytes.size(), 4));
  if (fault == Fault::delayed_answer) return {{now + 2 * wire.dice.uniform() * wire.dice.plan().delay_s, bytes, false}};
  if (fault == Fault::doubled_answer) return {{now, bytes, false}, {now, bytes, false}};
  if (fault == Fault::old_answer) {
    answer.id = static_cast<std::uint8_t>(answer.id - 1);
    return {{now, bytes_of(answer), false}, {now, bytes, false}};
  }
  return {{now, bytes, false}};
}

}  // namespace tribin::controller_sim
