// The hand-shake over both protocols under random faults: no double motion, no hang.
// usage: campaign_nx100 [CYCLES] [--sockets] [--seed S]
// Without --sockets client and controller share one thread and a clock that only waiting moves; with it they speak over
// the loopback, with clock and time-outs scaled 1:20.
#include "tribin/robot/nx100.hpp"

#include <cstdlib>
#include <cstring>

#include "support/handshake_campaign.hpp"
#include "tribin/controller_sim/server.hpp"
#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/robot/hses.hpp"

namespace {

using namespace tribin;
using namespace tribin::controller_sim;

constexpr double kScale = 20, kFaultRate = 0.05, kTroubleRate = 0.1;

void prepare(Machine& machine) {
  machine.add_job(parse_job(handshake_job(), "BPICK"));
  machine.start("BPICK");
}

MachineOptions gripping() {
  MachineOptions options;
  options.on_output = [](Machine& machine, int output, bool on) {
    if (output == 1) machine.set_input(1, on);
  };
  return options;
}

bool run(const char* name, bool nx100, bool sockets, int cycles, std::uint64_t seed) {
  Machine machine(gripping());
  Wire wire(machine, test::all_faults(kFaultRate, seed + 1000));
  prepare(machine);
  test::CampaignCounts counts;
  if (sockets) {
    const auto clock = robot::make_clock(kScale);
    ServerOptions options;
    options.protocol = nx100 ? Protocol::nx100 : Protocol::hses;
    Server server(wire, *clock, options);
    const auto client = nx100 ? robot::make_nx100(robot::tcp_stream("127.0.0.1", server.port(), *clock), *clock)
                              : robot::make_hses(robot::udp_link("127.0.0.1", server.port(), *clock), *clock);
    counts = test::run_handshakes(
        *client, *clock, machine, cycles, seed, [&server](auto&& work) { server.locked(work); }, kTroubleRate);
  } else {
    VirtualClock clock;
    const auto client = nx100 ? robot::make_nx100(virtual_stream(wire, clock), clock)
                              : robot::make_hses(virtual_datagrams(wire, clock), clock);
    counts = test::run_handshakes(
        *client, clock, machine, cycles, seed, [](auto&& work) { work(); }, kTroubleRate);
  }
  test::print(name, counts);
  std::fflush(stdout);
  std::printf("  %d commands, a fault at %.0f %% of them; trouble of the machine in %.0f %% of the cycles\n",
              wire.commands, kFaultRate * 100, kTroubleRate * 100);
  return counts.double_motions == 0 && counts.missing_motions == 0 && counts.wrong_positions == 0 && counts.hangs == 0;
}

}  // namespace

int main(int argc, char** argv) {
  int cycles = 10000;
  bool sockets = false;
  std::uint64_t seed = 5;
  for (int i = 1; i < argc; ++i)
    if (std::strcmp(argv[i], "--sockets") == 0)
      sockets = true;
    else if (std::strcmp(argv[i], "--seed") == 0 && i + 1 < argc)
      seed = std::strtoull(argv[++i], nullptr, 10);
    else
      cycles = std::atoi(argv[i]);
  const bool nx100 = run("nx100", true, sockets, cycles, seed), hses = run("hses", false, sockets, cycles, seed);
  return nx100 && hses ? 0 : 1;
}
