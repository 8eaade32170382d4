#pragma once

// A run that is killed again and again, and what is true of its rack each time.

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <random>
#include <thread>

#include "support/fake_cell.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/controller_sim/server.hpp"

namespace tribin::test {

struct KillCounts {
  int kills = 0, agree = 0, racks = 0, in_doubt = 0, failed = 0;
  int twice = 0, wrong = 0, lost = 0;
  int in_motion = 0;  ///< kills while an order was open
  int grips = 0, placed = 0;
};

inline int run_child(const std::string& program, const std::vector<std::string>& arguments, double kill_after_s) {
  const pid_t child = ::fork();
  if (child == 0) {
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    if (!std::freopen("/dev/null", "w", stdout)) ::_exit(126);
    ::execv(program.c_str(), argv.data());
    ::_exit(127);
  }
  int status = 0;
  const auto begin = std::chrono::steady_clock::now();
  while (kill_after_s >= 0) {
    if (::waitpid(child, &status, WNOHANG) == child) return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() > kill_after_s) {
      ::kill(child, SIGKILL);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Kills the program at random moments, lets a new one settle what is open, and compares journal and truth.
inline KillCounts kill_again_and_again(const std::string& program, bool nx100, int kills, std::uint64_t seed) {
  constexpr double kScale = 20;  // seconds of the controller in one of the world
  constexpr int kParts = 6;
  const WorkCell cell = fake_work_cell();
  const TemporaryFolder folder;
  const std::string bin_file = (folder.path() / "bin.txt").string();
  FakeTruth truth(cell, kParts, bin_file);
  controller_sim::Machine machine(truth.machine_options());
  machine.add_job(controller_sim::parse_job(controller_sim::handshake_job(), "BPICK"));
  machine.start("BPICK");
  controller_sim::Wire wire(machine, {{}, 0, 1, 2, 30, 5});
  const auto clock = robot::make_clock(kScale);
  controller_sim::ServerOptions options;
  options.protocol = nx100 ? controller_sim::Protocol::nx100 : controller_sim::Protocol::hses;
  controller_sim::Server server(wire, *clock, options);
  std::mt19937_64 random(seed);
  KillCounts counts;
  int rack = 0;
  std::string journal;
  const auto begin_rack = [&] {
    for (const auto& slot : truth.rack) counts.placed += static_cast<int>(slot.size());
    journal = (folder.path() / ("rack_" + std::to_string(++rack) + ".ndjson")).string();
    server.locked([&] { truth.refill(kParts); });
  };
  begin_rack();
  const std::size_t slots = picking::slots_of(*cell.rack).size();
  while (counts.kills < kills) {
    const std::vector<std::string> arguments = {std::to_string(server.port()), nx100 ? "nx100" : "hses", journal,
                                                bin_file, std::to_string(kScale)};
    const double after_s = std::uniform_real_distribution<>(0, 1.2)(random);
    const int ended = run_child(program, arguments, after_s);
    const bool killed = ended < 0;
    counts.kills += killed;
    {
      const picking::Journal left(journal, slots);
      counts.in_motion += killed && left.state().open.has_value();
    }
    // A new program settles what is open, and moves nothing.
    std::vector<std::string> recover = arguments;
    recover.push_back("--recover");
    const int settled = run_child(program, recover, -1);
    counts.in_doubt += settled == 6;
    counts.failed += settled != 0 && settled != 6;
    const picking::Journal now(journal, slots);
    bool agrees = settled == 0 && !now.state().open;
    server.locked([&] {
      for (std::size_t i = 0; i < slots; ++i) {
        const std::string stands = truth.rack[i].empty() ? "" : truth.rack[i].front();
        agrees = agrees && stands == now.state().filling[i];
        counts.twice += truth.rack[i].size() > 1;
        counts.wrong += !stands.empty() && stands != kind_of(static_cast<int>(i));
      }
      agrees = agrees && (truth.held >= 0) == now.state().in_hand.has_value();
      counts.lost = truth.lost;
      counts.grips = truth.grips;
    });
    counts.agree += killed && agrees;
    if (!killed || settled != 0) {  // the rack is full
      ++counts.racks;
      server.locked([&] {  // a program that ends leaves the robot held; the operator lets it go on
        machine.hold(false);
        machine.start("");
      });
      begin_rack();
    }
  }
  return counts;
}

inline void print(const char* name, const KillCounts& c) {
  std::printf(
      "%s: killed %d times (%d of them with an order under way), journal and truth agree %d of %d; racks begun %d, in "
      "doubt %d, failed %d, two in a slot %d, wrong part %d, lost %d; %d grips, %d placed\n",
      name, c.kills, c.in_motion, c.agree, c.kills, c.racks, c.in_doubt, c.failed, c.twice, c.wrong, c.lost, c.grips,
      c.placed);
}

}  // namespace tribin::test
