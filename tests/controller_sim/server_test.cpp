// The same on real sockets of the loopback, on faster clocks: no faster than a machine that is busy with other tests
// can answer in time.
#include "tribin/controller_sim/server.hpp"

#include <gtest/gtest.h>

#include "support/handshake_campaign.hpp"
#include "tribin/core/error.hpp"
#include "tribin/robot/hses.hpp"
#include "tribin/robot/nx100.hpp"

namespace tribin {
namespace {

using namespace controller_sim;

struct OnSockets : testing::TestWithParam<Protocol> {
  OnSockets() : clock(robot::make_clock(4)), machine(options()) {
    machine.add_job(parse_job(handshake_job(), "BPICK"));
    machine.start("BPICK");
  }
  static MachineOptions options() {
    MachineOptions options;
    options.on_output = [](Machine& m, int output, bool on) {
      if (output == 1) m.set_input(1, on);
    };
    return options;
  }
  std::unique_ptr<robot::Controller> client_of(int port) {
    if (GetParam() == Protocol::nx100) return robot::make_nx100(robot::tcp_stream("127.0.0.1", port, *clock), *clock);
    return robot::make_hses(robot::udp_link("127.0.0.1", port, *clock), *clock);
  }
  std::unique_ptr<robot::Clock> clock;
  Machine machine;
};

TEST_P(OnSockets, CyclesUnderRandomFaults) {
  clock = robot::make_clock(10);
  Wire wire(machine, test::all_faults(0.03, 3));
  Server server(wire, *clock, {.protocol = GetParam()});
  const auto client = client_of(server.port());
  const auto counts = test::run_handshakes(
      *client, *clock, machine, 6, 1, [&](auto&& work) { server.locked(work); }, 0.1);
  EXPECT_EQ(counts.double_motions, 0);
  EXPECT_EQ(counts.missing_motions, 0);
  EXPECT_EQ(counts.wrong_positions, 0);
  EXPECT_EQ(counts.hangs, 0);
  EXPECT_GE(counts.done, 3);
}

TEST_P(OnSockets, AServerThatComesBackIsFoundAgain) {
  Wire wire(machine, {});
  auto server = std::make_unique<Server>(wire, *clock, ServerOptions{.protocol = GetParam()});
  const int port = server->port();
  const auto client = client_of(port);
  EXPECT_TRUE(client->status().play);
  server.reset();
  EXPECT_THROW(client->status(), robot::ControllerError);
  server = std::make_unique<Server>(wire, *clock, ServerOptions{.protocol = GetParam(), .port = port});
  EXPECT_TRUE(client->status().play);
}

INSTANTIATE_TEST_SUITE_P(Protocols, OnSockets, testing::Values(Protocol::nx100, Protocol::hses),
                         [](const auto& info) { return info.param == Protocol::nx100 ? "nx100" : "hses"; });

TEST(Server, RefusesASecondClientWhereToldTo) {
  const auto clock = robot::make_clock(2);
  Machine machine;
  FaultPlan plan;
  plan.faults = {Fault::second_refused};
  Wire wire(machine, plan);
  Server server(wire, *clock, {});
  const auto first = robot::make_nx100(robot::tcp_stream("127.0.0.1", server.port(), *clock), *clock);
  EXPECT_TRUE(first->status().play);
  const auto second = robot::make_nx100(robot::tcp_stream("127.0.0.1", server.port(), *clock), *clock);
  EXPECT_THROW(second->status(), robot::ControllerError);
  EXPECT_TRUE(first->status().play);
}

TEST(Server, SaysWhereItCannotServe) {
  const auto clock = robot::make_clock();
  Machine machine;
  Wire wire(machine, {});
  Server server(wire, *clock, {});
  EXPECT_THROW(Server(wire, *clock, {.port = server.port()}), Error);
  EXPECT_THROW(Server(wire, *clock, {.address = "nowhere"}), Error);
}

}  // namespace
}  // namespace tribin
