#include "tribin/robot/controller_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#include "support/handshake_campaign.hpp"
#include "tribin/controller_sim/server.hpp"
#include "tribin/robot/nx100.hpp"
#include "tribin/robot/watchdog.hpp"

namespace tribin {
namespace {

using namespace controller_sim;

struct QueueTest : testing::Test {
  std::unique_ptr<robot::ControllerQueue> queue(double idle_s) {
    return robot::make_queue(robot::make_nx100(robot::tcp_stream("127.0.0.1", server.port(), *clock), *clock), *clock,
                             {idle_s});
  }
  std::unique_ptr<robot::Clock> clock = robot::make_clock(2);
  bool machine_is_held() {
    bool held = false;
    server.locked([&] { held = machine.status().held_by_command; });
    return held;
  }
  // Ready before the server's thread sees it.
  static Machine running_machine() {
    MachineOptions options;
    options.on_output = [](Machine& m, int output, bool on) {
      if (output == 1) m.set_input(1, on);
    };
    Machine machine(options);
    machine.add_job(parse_job(handshake_job(), "BPICK"));
    machine.start("BPICK");
    return machine;
  }
  Machine machine = running_machine();
  Wire wire{machine, {}};
  Server server{wire, *clock, {}};
};

TEST_F(QueueTest, ManyThreadsGetTheirOwnAnswers) {
  const auto controller = queue(5);
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 50; ++i) {
        controller->write_integer(10 + t, i * 4 + t);
        wrong += controller->read_integer(10 + t) != i * 4 + t;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_THROW(controller->read_position(99), robot::ControllerError);
}

TEST_F(QueueTest, AHoldGoesBeforeAllThatWaits) {
  const auto controller = queue(5);
  std::mt19937_64 random(1);
  const auto order = test::random_order(1, random);
  std::atomic<bool> ended{false};
  std::thread cycle([&] {
    EXPECT_THROW(run_cycle(*controller, *clock, order), robot::ControllerError);
    ended = true;
  });
  std::vector<std::thread> busy;
  for (int t = 0; t < 3; ++t)
    busy.emplace_back([&] {
      while (!ended) controller->read_byte(1);
    });
  for (bool moves = false; !moves; clock->sleep_s(0.02)) server.locked([&] { moves = !machine.moves().empty(); });
  controller->hold(true);
  bool held = false;
  server.locked([&] { held = machine.status().held_by_command && !machine.status().running; });
  EXPECT_TRUE(held);
  cycle.join();
  for (std::thread& thread : busy) thread.join();
}

TEST_F(QueueTest, AsksForTheStatusWhileIdle) {
  const auto controller = queue(0.1);
  EXPECT_FALSE(controller->heard_s());
  clock->sleep_s(0.8);
  ASSERT_TRUE(controller->heard_s());
  int commands = 0;
  server.locked([&] { commands = wire.commands; });
  EXPECT_GE(commands, 3);
}

TEST_F(QueueTest, TheWatchdogHoldsARobotWhoseClientIsGone) {
  const auto controller = queue(5);
  std::atomic<double> client_s{clock->now_s()};
  std::mutex mutex;
  std::vector<std::string> told;
  robot::Watchdog dog(
      *controller, *clock,
      [&] {
        robot::WatchFacts facts;
        facts.client_s = client_s;
        facts.scan_s = clock->now_s();
        return facts;
      },
      {.silence_s = 20, .client_s = 3},
      [&](const std::string& reason, bool held) {
        const std::lock_guard lock(mutex);
        told.push_back(reason + (held ? ": held" : ": not held"));
      });
  clock->sleep_s(1.5);  // not on watch yet
  EXPECT_FALSE(machine_is_held());
  client_s = clock->now_s();
  dog.watch(true);
  for (int i = 0; i < 5; ++i) {  // a client that is heard
    client_s = clock->now_s();
    clock->sleep_s(0.2);
  }
  EXPECT_FALSE(machine_is_held());
  for (int i = 0; i < 200 && dog.watching(); ++i) clock->sleep_s(0.1);  // and then no more
  EXPECT_TRUE(machine_is_held());
  clock->sleep_s(0.3);
  const std::lock_guard lock(mutex);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("the client was not heard"), std::string::npos);
  EXPECT_TRUE(told[0].ends_with(": held"));
}

}  // namespace
}  // namespace tribin
