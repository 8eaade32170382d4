#include "tribin/robot/handshake.hpp"

#include <cmath>

namespace tribin::robot {
namespace {

/// The place of each variable of the hand-shake.
struct Places {
  int command, status, part_class, result, count;  // B
  int cycle, taken, done, opening;                 // I
};
Places places_of(const HandshakeVariables& v) {
  return {v.bytes,    v.bytes + 1,    v.bytes + 2,    v.bytes + 3,   v.bytes + 4,
          v.integers, v.integers + 1, v.integers + 2, v.integers + 3};
}

/// The first of the P variables that belong to a command.
int first_position(CycleCommand command, const HandshakeVariables& v) {
  switch (command) {
    case CycleCommand::place:
      return v.positions + 4;
    case CycleCommand::way_points:
      return v.positions + 7;
    default:
      return v.positions + 1;
  }
}

/// Drives one controller through one cycle.
class Shake {
 public:
  Shake(Controller& controller, Clock& clock, const HandshakeOptions& options)
      : controller_(controller), clock_(clock), options_(options), at_(places_of(options.variables)) {}

  /// Writes by `write` until `holds` says that it is there. Writing a value twice changes nothing; the command itself
  /// does not go this way.
  template <class Write, class Holds>
  void write_surely(const std::string& what, Write write, Holds holds) {
    for (int attempt = 1;; ++attempt) {
      try {
        write();
        if (holds()) return;
      } catch (const ControllerError& error) {
        // A message number is the controller's own word: to ask again changes nothing.
        if (error.fault() == ControllerFault::refused && error.number() != 0) throw;
        if (attempt >= options_.attempts) throw;
        clock_.sleep_s(options_.poll_s);
        continue;
      }
      if (attempt >= options_.attempts)
        throw ControllerError(ControllerFault::bad_answer, what + " does not keep what is written into it");
    }
  }

  void write_byte(int number, int value) {
    write_surely(
        "B" + std::to_string(number), [&] { controller_.write_byte(number, value); },
        [&] { return controller_.read_byte(number) == value; });
  }
  void write_integer(int number, int value) {
    write_surely(
        "I" + std::to_string(number), [&] { controller_.write_integer(number, value); },
        [&] { return controller_.read_integer(number) == value; });
  }
  void write_position(int number, const CartesianPosition& value) {
    write_surely(
        "P" + std::to_string(number), [&] { controller_.write_position(number, value); },
        [&] { return same_position(controller_.read_position(number), value, controller_.angle_step_deg()); });
  }

  /// Reads again where the link fails; what the controller refuses it refuses.
  template <class Read>
  auto read(Read read_once) {
    for (int attempt = 1;; ++attempt) try {
        return read_once();
      } catch (const ControllerError& error) {
        if ((error.fault() == ControllerFault::refused && error.number() != 0) || attempt >= options_.attempts) throw;
        clock_.sleep_s(options_.poll_s);
      }
  }

  CycleRecord record(int cycle) {
    return read([&] {
      // Done first: a cycle that ends between the two reads is then under way still, never lost.
      const bool done = controller_.read_integer(at_.done) == cycle;
      if (!done && controller_.read_integer(at_.taken) != cycle) return CycleRecord{};
      if (!done) return CycleRecord{CycleState::under_way, {}};
      const int result = controller_.read_byte(at_.result);
      if (result < 1 || result > 4)
        throw ControllerError(ControllerFault::bad_answer,
                              "the job gives result " + std::to_string(result) + ", wanted 1 to 4");
      return CycleRecord{CycleState::done, static_cast<CycleResult>(result)};
    });
  }

  void check(const ControllerStatus& status) {
    if (!status.ready() || !status.running)
      throw ControllerError(ControllerFault::refused,
                            std::string("the job cannot work: ") + (!status.remote     ? "not remote"
                                                                    : !status.play     ? "not in play"
                                                                    : status.alarm     ? "alarm"
                                                                    : status.error     ? "error"
                                                                    : status.held()    ? "held"
                                                                    : !status.servo_on ? "servos are off"
                                                                                       : "it does not run"));
    if (options_.may_go_on && !options_.may_go_on(status)) {
      controller_.hold(true);
      throw ControllerError(ControllerFault::unknown_outcome, "put on hold by the supervision");
    }
  }

  void prepare(const CycleOrder& order) {
    if (order.cycle < 1 || order.cycle > 32767)
      throw ControllerError(ControllerFault::not_sent, "a cycle number is 1 to 32767");
    const bool way = order.command == CycleCommand::way_points, waist = order.command == CycleCommand::turn_waist;
    if (way ? order.positions.empty() || order.positions.size() > 6 : order.positions.size() != (waist ? 0u : 3u))
      throw ControllerError(ControllerFault::not_sent, way     ? "wanted 1 to 6 way points"
                                                       : waist ? "wanted no positions"
                                                               : "wanted 3 positions");
    check(read([&] { return controller_.status(); }));
    const CycleRecord before = record(order.cycle);
    if (before.state != CycleState::never_taken)
      throw ControllerError(ControllerFault::not_sent, "cycle " + std::to_string(order.cycle) +
                                                           " is known to the job already: it is not sent again");
    if (read([&] { return controller_.read_byte(at_.command); }) != 0)
      throw ControllerError(ControllerFault::not_sent, "the job has a command of someone else");
    int number = first_position(order.command, options_.variables);
    for (const CartesianPosition& position : order.positions) write_position(number++, position);
    write_byte(at_.part_class, order.part_class);
    write_byte(at_.count, way ? static_cast<int>(order.positions.size()) : 0);
    write_integer(at_.opening, static_cast<int>(std::lround(order.opening_mm * 10)));
    if (waist) write_integer(kWaistWanted, static_cast<int>(std::lround(order.waist_rad / kDegree * 10)));
    write_integer(at_.cycle, order.cycle);
    write_byte(at_.status, 0);
    write_byte(at_.result, 0);
  }

  /// Writes the command and sees to it that the job takes it, once.
  void give(const CycleOrder& order) {
    const int command = static_cast<int>(order.command);
    const double until = clock_.now_s() + options_.take_s;
    bool written = write_command(command);
    while (record(order.cycle).state == CycleState::never_taken) {
      if (clock_.now_s() > until)
        throw ControllerError(ControllerFault::unknown_outcome, "the job does not take the command");
      check(read([&] { return controller_.status(); }));
      if (written) {
        clock_.sleep_s(options_.poll_s);
        continue;
      }
      // The outcome is unknown. Wait until nothing of it can be on the way any more; only where neither the command nor
      // its acknowledgement is there it never came. The job itself refuses a number that it has had.
      clock_.sleep_s(options_.settle_s);
      const bool there = read([&] { return controller_.read_byte(at_.command); }) == command;
      if (record(order.cycle).state != CycleState::never_taken) return;
      written = there || write_command(command);
    }
  }

  std::optional<CycleResult> look(int cycle) {
    const CycleRecord now = record(cycle);
    if (now.state == CycleState::done) return *now.result;
    if (now.state == CycleState::never_taken)
      throw ControllerError(ControllerFault::unknown_outcome,
                            "the job took cycle " + std::to_string(cycle) + " and forgot it");
    check(read([&] { return controller_.status(); }));
    return {};
  }

  CycleResult finish(int cycle) {
    const double until = clock_.now_s() + options_.finish_s;
    while (true) {
      if (const auto result = look(cycle)) return *result;
      if (clock_.now_s() > until) throw ControllerError(ControllerFault::unknown_outcome, "the cycle does not end");
      clock_.sleep_s(options_.poll_s);
    }
  }

 private:
  /// \return false where the outcome is unknown
  bool write_command(int command) {
    for (int attempt = 1;; ++attempt) try {
        controller_.write_byte(at_.command, command);
        return true;
      } catch (const ControllerError& error) {
        if (error.fault() == ControllerFault::unknown_outcome) return false;
        if ((error.fault() == ControllerFault::refused && error.number() != 0) || attempt >= options_.attempts) throw;
        clock_.sleep_s(options_.poll_s);
      }
  }

  Controller& controller_;
  Clock& clock_;
  const HandshakeOptions& options_;
  Places at_;
};

}  // namespace

int next_cycle(int cycle) { return cycle >= 32767 || cycle < 1 ? 1 : cycle + 1; }

CycleRecord read_record(Controller& controller, Clock& clock, int cycle, const HandshakeOptions& options) {
  return Shake(controller, clock, options).record(cycle);
}

CycleResult run_cycle(Controller& controller, Clock& clock, const CycleOrder& order, const HandshakeOptions& options) {
  Shake shake(controller, clock, options);
  shake.prepare(order);
  shake.give(order);
  return shake.finish(order.cycle);
}

void begin_cycle(Controller& controller, Clock& clock, const CycleOrder& order, const HandshakeOptions& options) {
  Shake shake(controller, clock, options);
  shake.prepare(order);
  shake.give(order);
}

std::optional<CycleResult> look_at_cycle(Controller& controller, Clock& clock, int cycle,
                                         const HandshakeOptions& options) {
  return Shake(controller, clock, options).look(cycle);
}

int holder_of(Controller& controller, Clock& clock, Zone zone, const HandshakeOptions& options) {
  return Shake(controller, clock, options).read([&] { return controller.read_byte(static_cast<int>(zone)); });
}

void hand_zone(Controller& controller, Clock& clock, Zone zone, int arm, const HandshakeOptions& options) {
  const int holder = holder_of(controller, clock, zone, options);
  if (arm != 0 && holder != 0 && holder != arm)
    throw ControllerError(ControllerFault::not_sent, std::string(zone == Zone::bin ? "the bin" : "the rack") +
                                                         " belongs to arm " + std::to_string(holder));
  Shake(controller, clock, options).write_byte(static_cast<int>(zone), arm);
}

CycleResult finish_cycle(Controller& controller, Clock& clock, int cycle, const HandshakeOptions& options) {
  return Shake(controller, clock, options).finish(cycle);
}

}  // namespace tribin::robot
