// The instructions of a job, one after the other.

#include <cmath>

#include "tribin/controller_sim/machine.hpp"

namespace tribin::controller_sim {
namespace {

constexpr double kInputPoll_s = 0.01;  // how often WAIT IN# looks
constexpr std::size_t kDeepestCall = 8;
constexpr int kCycleTaken = 1;     // I001 of the hand-shake, I011 of the second arm's
constexpr int kJobTrouble = 4400;  // alarm: a job, position or label that is not there

}  // namespace

double Machine::value_of(const Operand& operand) const {
  const auto get = [&operand](const auto& map) {
    const auto at = map.find(operand.index);
    return at == map.end() ? 0.0 : static_cast<double>(at->second);
  };
  switch (operand.kind) {
    case 'B':
      return get(bytes);
    case 'I':
      return get(integers);
    case 'D':
      return get(doubles);
    case 'R':
      return get(reals);
    default:
      return operand.value;
  }
}

void Machine::set_value(const Operand& target, double value) {
  const double whole = std::round(value);
  const auto within = [whole](double least, double most) { return whole >= least && whole <= most; };
  if (target.kind == 'R')
    reals[target.index] = value;
  else if (target.kind == 'B' && within(0, 255))
    bytes[target.index] = static_cast<int>(whole);
  else if (target.kind == 'I' && within(-32768, 32767))
    integers[target.index] = static_cast<int>(whole);
  else if (target.kind == 'D' && within(-2147483648.0, 2147483647.0))
    doubles[target.index] = static_cast<long>(whole);
  else
    raise_alarm(kJobTrouble, 2);  // data out of range
}

bool Machine::holds(const Condition& condition) const {
  if (condition.input) return input(condition.input_number) == condition.on;
  const double left = value_of(condition.left), right = value_of(condition.right);
  switch (condition.comparison) {
    case Comparison::equal:
      return left == right;
    case Comparison::not_equal:
      return left != right;
    case Comparison::less:
      return left < right;
    case Comparison::greater:
      return left > right;
    case Comparison::less_equal:
      return left <= right;
    case Comparison::greater_equal:
      return left >= right;
  }
  return false;
}

const robot::PositionVariable* Machine::find_position(const Instruction& instruction) const {
  const auto find = [&instruction](const auto& map) -> const robot::PositionVariable* {
    const auto at = map.find(instruction.position_index);
    return at == map.end() ? nullptr : &at->second;
  };
  return instruction.position == 'P' ? find(positions) : find(jobs_.at(task().stack.back().job).positions);
}

void Machine::step_job() {
  const Instruction* instruction = current();
  if (!instruction) return raise_alarm(kJobTrouble);
  task().busy_until = now_ + options_.instruction_s;
  execute(*instruction);
}

void Machine::execute(const Instruction& instruction) {
  std::size_t& at = task().stack.back().at;
  switch (instruction.operation) {
    case Operation::movj:
    case Operation::movl:
    case Operation::imov: {
      const robot::PositionVariable* position = find_position(instruction);
      const auto* goal = position ? std::get_if<robot::CartesianPosition>(position) : nullptr;
      if (!goal) return raise_alarm(kJobTrouble, 1);  // never taught, or in pulses, which this machine cannot place
      const bool joint = instruction.operation == Operation::movj;
      robot::CartesianPosition to = *goal;
      if (instruction.operation == Operation::imov)
        for (int i = 0; i < 3; ++i) to.numbers[i] = task().standing.numbers[i] + goal->numbers[i];
      if (task().interrupted)
        to = task().motion.goal;  // the move that was stopped goes on: it is not a second one
      else
        record({now_, instruction.position, instruction.position_index,
                integers[kCycleTaken + 10 * static_cast<int>(task_)], static_cast<int>(task_) + 1});
      task().interrupted = false;
      const double share = joint ? instruction.speed / 100 : 1;
      begin_motion(to, joint ? share * options_.greatest_speed_mm_s : instruction.speed,
                   share * options_.greatest_turn_deg_s);
      return;  // the next instruction comes when the move is done
    }
    case Operation::set:
      set_value(instruction.target, value_of(instruction.value));
      break;
    case Operation::add:
      set_value(instruction.target, value_of(instruction.target) + value_of(instruction.value));
      break;
    case Operation::sub:
      set_value(instruction.target, value_of(instruction.target) - value_of(instruction.value));
      break;
    case Operation::inc:
      set_value(instruction.target, value_of(instruction.target) + 1);
      break;
    case Operation::dec:
      set_value(instruction.target, value_of(instruction.target) - 1);
      break;
    case Operation::timer:
      task().busy_until = now_ + std::max(instruction.seconds, options_.instruction_s);
      break;
    case Operation::jump:
      if (!instruction.condition || holds(*instruction.condition)) {
        at = jobs_.at(task().stack.back().job).labels.at(instruction.text);
        return;
      }
      break;
    case Operation::call:
      if (!instruction.condition || holds(*instruction.condition)) {
        if (!has_job(instruction.text) || task().stack.size() >= kDeepestCall) return raise_alarm(kJobTrouble);
        ++at;
        task().stack.push_back({instruction.text, 0});
        return;
      }
      break;
    case Operation::dout:
      set_output(instruction.io, instruction.on);
      break;
    case Operation::wait_input:
      if (!holds(*instruction.condition)) {
        if (task().wait_until < 0) task().wait_until = instruction.seconds < 0 ? HUGE_VAL : now_ + instruction.seconds;
        if (now_ < task().wait_until) {
          task().busy_until = now_ + kInputPoll_s;
          return;
        }
      }
      task().wait_until = -1;
      break;
    case Operation::message:
      pendant_text = instruction.text;
      break;
    case Operation::ret:
    case Operation::end:
      if (task().stack.size() > 1) {
        task().stack.pop_back();
      } else {
        at = 0;
        // One cycle ends here; continuous begins again, after a moment even where the job does nothing.
        if (cycle_mode != 3 && task_ == 0) running_ = false;
      }
      return;
    case Operation::pause:
      ++at;
      held_command_ = true;
      return stop();
    case Operation::abort_job:
      return raise_alarm(kJobTrouble, 3);
    case Operation::nop:
    case Operation::label:
      break;
  }
  if (running_) ++at;
}

}  // namespace tribin::controller_sim
