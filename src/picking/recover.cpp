// After a crash: what the journal leaves open is asked of the controller, and where that cannot tell, of a person.
#include "picking/run.hpp"
#include "tribin/core/error.hpp"

namespace tribin::picking {

std::string what_was_ordered(const Entry& entry) {
  switch (entry.event) {
    case Event::pick_ordered:
      return "the pick of " + entry.part;
    case Event::place_ordered:
      return "the place of " + entry.part + (entry.slot ? " in slot " + std::to_string(entry.slot) : " at the station");
    default:
      return "a move";
  }
}

Phase Run::in_doubt(const std::string& what) {
  const Entry& open = now().open ? *now().open : *now().in_hand;
  const std::string where = open.slot ? "slot " + std::to_string(open.slot) : std::string("the station");
  return finish("in_doubt", what + "; look at the gripper and at " + where +
                                ", take away what the gripper holds, then say --slot-is full or --slot-is empty");
}

void Run::take_answer() {
  if (!now().open && !now().in_hand) return;  // nothing was in doubt
  Entry said = now().open ? *now().open : *now().in_hand;
  said.event = Event::operator_said;
  said.cycle = 0;
  if (*options_.answer == Answer::slot_empty || !said.slot) said.part.clear();
  journal_.write(said);
}

bool settle(const RunLinks& links, const robot::HandshakeOptions& shake, int arm) {
  const HandState hand = links.journal->state().hand(arm);
  const Entry open = *hand.open;
  robot::Controller& controller = *links.controller;
  robot::Clock& clock = *links.clock;
  const auto note_end = [&](robot::CycleResult result) {
    links.journal->write(end_of(open, result));
    must_be_no_fault(open, result);
  };
  // What was under way to the controller when the program ended has come by then.
  clock.sleep_s(shake.settle_s);
  robot::CycleRecord record = read_record(controller, clock, open.cycle, shake);
  const double until = clock.now_s() + shake.take_s;
  while (record.state == robot::CycleState::never_taken && controller.read_byte(shake.variables.bytes) != 0 &&
         clock.now_s() < until) {
    clock.sleep_s(shake.poll_s);
    record = read_record(controller, clock, open.cycle, shake);
  }
  if (record.state == robot::CycleState::never_taken) {
    // That is believed where the controller still knows the cycle before, and no command waits in it.
    const bool waits = controller.read_byte(shake.variables.bytes) != 0;
    const bool knows = hand.last_taken == 0 || controller.read_integer(shake.variables.integers + 1) == hand.last_taken;
    if (waits || !knows) return false;
    Entry entry = open;
    entry.event = Event::not_taken;
    links.journal->write(entry);
    return true;
  }
  if (record.state == robot::CycleState::under_way) {
    const robot::ControllerStatus status = controller.status();
    if (!status.ready() || !status.running) return false;
    note_end(finish_cycle(controller, clock, open.cycle, shake));
    return true;
  }
  note_end(*record.result);
  return true;
}

Phase Run::recover() {
  if (options_.answer) take_answer();
  if (now().open) {
    const Entry open = *now().open;
    if (!settle(links_, options_.handshake, open.arm))
      return in_doubt(what_was_ordered(open) + " (cycle " + std::to_string(open.cycle) +
                      ") was ordered, and the controller does not tell how it ended");
  }
  if (options_.recover_only) return finish("recovered", "nothing is open");
  if (now().in_hand) return with_part();
  return now().at_station ? Phase::regrasp : Phase::scan;
}

}  // namespace tribin::picking
