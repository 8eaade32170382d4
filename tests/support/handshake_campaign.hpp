#pragma once

// Many cycles of the hand-shake under random faults, judged by what the simulated controller did.

#include <algorithm>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tribin/controller_sim/sessions.hpp"
#include "tribin/robot/handshake.hpp"

namespace tribin::test {

struct CampaignCounts {
  int cycles = 0;  ///< that were ordered
  int done = 0;
  int recovered = 0;        ///< ended only after an Error, a look at the record and an operator
  int never_taken = 0;      ///< given up before the job had them
  int double_motions = 0;   ///< moves of one cycle that the machine began twice
  int missing_motions = 0;  ///< cycles said to be done whose moves were not all made
  int wrong_positions = 0;  ///< moves that went elsewhere than ordered
  int hangs = 0;            ///< cycles of more than ten minutes of the controller's time
};

/// What one cycle did to the machine.
class MotionJudge {
 public:
  explicit MotionJudge(controller_sim::Machine& machine) : machine_(machine) {}

  void judge(const robot::CycleOrder& order, bool said_done, CampaignCounts& counts) {
    std::map<int, int> begun;  // position -> times
    for (const auto& move : machine_.moves()) begun[move.index] += move.cycle == order.cycle;
    for (const auto& [index, times] : begun) counts.double_motions += times > 1;
    const int first = order.command == robot::CycleCommand::place ? 4 : 1;
    if (said_done)
      for (int i = 0; i < 3; ++i) counts.missing_motions += begun[first + i] != 1;
    if (said_done) {
      const auto at = machine_.position();
      for (int i = 0; i < 3; ++i)
        counts.wrong_positions += std::abs(at.numbers[i] - order.positions[2].numbers[i]) > 1e-3;
    }
    machine_.forget_moves();
  }

 private:
  controller_sim::Machine& machine_;
};

inline robot::CycleOrder random_order(int cycle, std::mt19937_64& random) {
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random);
  };
  robot::CycleOrder order;
  order.cycle = cycle;
  order.command = cycle % 2 ? robot::CycleCommand::pick : robot::CycleCommand::place;
  order.part_class = static_cast<int>(random() % 3);
  const double x = between(400, 800), y = between(-300, 300), z = between(50, 250);
  for (const double lift : {100.0, 0.0, 150.0}) {
    robot::CartesianPosition position;
    position.numbers = {std::round(x * 1000) / 1000,
                        std::round(y * 1000) / 1000,
                        std::round((z + lift) * 1000) / 1000,
                        180,
                        0,
                        std::round(between(-180, 180) * 100) / 100};
    position.type = 1;
    position.tool = 1;
    order.positions.push_back(position);
  }
  return order;
}

/// The operator of the campaign: brings the machine back into play, by hand and not over the wire.
inline void put_right(controller_sim::Machine& machine, const std::string& job) {
  machine.emergency_stop(false);
  machine.remove_cause();
  machine.set_remote(true);
  machine.hold_by_pendant(false);
  machine.hold_externally(false);
  machine.reset();
  machine.cancel();
  machine.mode(true);
  machine.hold(false);
  machine.servo(true);
  if (!machine.status().running && machine.start("") != 0) machine.start(job);
}

/// \param locked  runs a function while no server touches the machine
template <class Locked>
CampaignCounts run_handshakes(robot::Controller& controller, robot::Clock& clock, controller_sim::Machine& machine,
                              int cycles, std::uint64_t seed, Locked locked, double trouble_rate) {
  std::mt19937_64 random(seed);
  const auto chance = [&random](double share) { return std::uniform_real_distribution<>(0, 1)(random) < share; };
  CampaignCounts counts;
  robot::HandshakeOptions options;
  options.finish_s = 120;
  int polls = 0;
  bool trouble = false;
  // Now and then something happens to the machine itself while it works.
  options.may_go_on = [&](const robot::ControllerStatus&) {
    if (trouble && ++polls == 4) {
      trouble = false;
      const auto what = random() % 4;
      if (what == 3) return false;  // the supervision wants a hold
      locked([&] {
        if (what == 0) machine.raise_alarm(4107);
        if (what == 1) machine.emergency_stop(true);
        if (what == 2) machine.hold_by_pendant(true);
      });
    }
    return true;
  };
  MotionJudge judge(machine);
  int cycle = 0;
  for (int i = 0; i < cycles; ++i) {
    const robot::CycleOrder order = random_order(cycle = robot::next_cycle(cycle), random);
    ++counts.cycles;
    polls = 0;
    trouble = chance(trouble_rate);
    const double begin = clock.now_s();
    bool done = false;
    std::string last;
    // As a program does: order once; after any Error read the record first, and never order again what was taken.
    bool ordered = false, errors = false;
    for (int attempt = 0; attempt < 50 && !done; ++attempt) {
      try {
        if (!ordered) {
          ordered = true;
          done = run_cycle(controller, clock, order, options) == robot::CycleResult::done;
        } else {
          const robot::CycleRecord record = read_record(controller, clock, order.cycle, options);
          if (record.state == robot::CycleState::never_taken) {
            // Whether its command still stands in B000 decides: a job that goes on would take it.
            if (controller.read_byte(0) == 0) break;
            done = finish_cycle(controller, clock, order.cycle, options) == robot::CycleResult::done;
          } else {
            done = finish_cycle(controller, clock, order.cycle, options) == robot::CycleResult::done;
          }
        }
      } catch (const robot::ControllerError& error) {
        errors = true;
        last = error.what();
        trouble = false;
        clock.sleep_s(0.5);
        locked([&] { put_right(machine, "BPICK"); });
      }
    }
    counts.done += done;
    counts.recovered += done && errors;
    counts.never_taken += !done;
    counts.hangs += clock.now_s() - begin > 600;
    locked([&] { judge.judge(order, done, counts); });
  }
  return counts;
}

inline void print(const char* name, const CampaignCounts& c) {
  std::printf(
      "%s: %d cycles, %d done (%d of them after an error), %d given up before the job took them; double motions %d, "
      "missing motions %d, wrong positions %d, hangs %d\n",
      name, c.cycles, c.done, c.recovered, c.never_taken, c.double_motions, c.missing_motions, c.wrong_positions,
      c.hangs);
}

/// All faults of a command or a connection.
inline controller_sim::FaultPlan all_faults(double rate, std::uint64_t seed) {
  controller_sim::FaultPlan plan;
  for (int i = 0; i < controller_sim::kFaults; ++i) {
    const auto fault = static_cast<controller_sim::Fault>(i);
    if (fault != controller_sim::Fault::second_refused) plan.faults.push_back(fault);
  }
  plan.rate = rate;
  plan.seed = seed;
  plan.delay_s = 2;
  plan.close_after = 40;
  plan.idle_s = 3;
  return plan;
}

}  // namespace tribin::test
