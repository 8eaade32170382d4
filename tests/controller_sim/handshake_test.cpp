#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "support/handshake_campaign.hpp"
#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/robot/hses.hpp"
#include "tribin/robot/nx100.hpp"
#include "tribin/robot/safety.hpp"

namespace tribin {
namespace {

using namespace controller_sim;
using robot::ControllerError;
using robot::ControllerFault;
using robot::CycleCommand;
using robot::CycleResult;
using robot::CycleState;

/// A machine with the job running, a gripper that grips, and a client of either protocol.
struct Cell {
  explicit Cell(const std::string& protocol, FaultPlan plan = {}, bool grips = true)
      : machine({.on_output =
                     [grips](Machine& m, int output, bool on) {
                       if (output == 1) m.set_input(1, on && grips);
                     }}),
        wire(machine, std::move(plan)) {
    machine.add_job(parse_job(handshake_job(), "BPICK"));
    machine.start("BPICK");
    if (protocol == "nx100")
      client = robot::make_nx100(virtual_stream(wire, clock), clock);
    else
      client = robot::make_hses(virtual_datagrams(wire, clock), clock);
  }
  Machine machine;
  Wire wire;
  VirtualClock clock;
  std::unique_ptr<robot::Controller> client;
  std::mt19937_64 random{1};
};

struct Handshake : testing::TestWithParam<const char*> {};

TEST_P(Handshake, PicksAndPlaces) {
  Cell cell(GetParam());
  for (int cycle = 1; cycle <= 4; ++cycle) {
    const auto order = test::random_order(cycle, cell.random);
    EXPECT_EQ(read_record(*cell.client, cell.clock, cycle).state, CycleState::never_taken);
    EXPECT_EQ(run_cycle(*cell.client, cell.clock, order), CycleResult::done);
    EXPECT_EQ(read_record(*cell.client, cell.clock, cycle).state, CycleState::done);
    EXPECT_EQ(cell.machine.bytes[2], order.part_class);
  }
  EXPECT_EQ(cell.machine.moves().size(), 12u);
}

TEST_P(Handshake, TellsThatNothingWasGrippedOrThatItWasLost) {
  Cell empty(GetParam(), {}, false);
  auto pick = test::random_order(1, empty.random);
  EXPECT_EQ(run_cycle(*empty.client, empty.clock, pick), CycleResult::grip_missing);
  EXPECT_FALSE(empty.machine.output(1));  // opened again

  Cell cell(GetParam());
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, pick), CycleResult::done);
  cell.machine.set_input(1, false);
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, test::random_order(2, cell.random)), CycleResult::part_lost);
}

TEST_P(Handshake, PutsBackAndGoesAlongWayPoints) {
  Cell cell(GetParam());
  auto order = test::random_order(1, cell.random);
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order), CycleResult::done);
  order.command = CycleCommand::put_back;
  order.cycle = 2;
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order), CycleResult::done);
  EXPECT_FALSE(cell.machine.output(1));
  for (int count = 1; count <= 6; ++count) {
    cell.machine.forget_moves();
    order.command = CycleCommand::way_points;
    order.cycle = 2 + count;
    order.positions.assign(static_cast<std::size_t>(count), order.positions.front());
    for (int i = 0; i < count; ++i) order.positions[static_cast<std::size_t>(i)].numbers[0] += 10 * i;
    EXPECT_EQ(run_cycle(*cell.client, cell.clock, order), CycleResult::done);
    EXPECT_EQ(static_cast<int>(cell.machine.moves().size()), count);
    EXPECT_NEAR(cell.machine.position().numbers[0], order.positions.back().numbers[0], 1e-6);
  }
}

TEST_P(Handshake, NeverSendsACycleTwice) {
  Cell cell(GetParam());
  const auto order = test::random_order(1, cell.random);
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order), CycleResult::done);
  try {
    run_cycle(*cell.client, cell.clock, order);
    FAIL();
  } catch (const ControllerError& error) {
    EXPECT_EQ(error.fault(), ControllerFault::not_sent);
  }
  EXPECT_EQ(cell.machine.moves().size(), 3u);
  // A command of before that comes late: the job itself refuses the number.
  cell.machine.bytes[0] = 1;
  for (double t = 0; t < 10; t += 0.1) cell.machine.advance(cell.clock.now_s() + t);
  EXPECT_EQ(cell.machine.moves().size(), 3u);
  EXPECT_EQ(cell.machine.bytes[0], 0);
}

TEST_P(Handshake, StopsWithAReasonWhereTheMachineCannot) {
  Cell cell(GetParam());
  cell.machine.hold(true);
  EXPECT_THROW(run_cycle(*cell.client, cell.clock, test::random_order(1, cell.random)), ControllerError);
  cell.machine.hold(false);
  cell.machine.start("");
  robot::HandshakeOptions options;
  options.may_go_on = [](const robot::ControllerStatus&) { return false; };
  EXPECT_THROW(run_cycle(*cell.client, cell.clock, test::random_order(1, cell.random), options), ControllerError);
  EXPECT_TRUE(cell.machine.status().held_by_command);
  EXPECT_TRUE(cell.machine.moves().empty());
}

TEST_P(Handshake, AfterACrashTheRecordTellsWhatWas) {
  Cell cell(GetParam());
  const auto order = test::random_order(1, cell.random);
  int polls = 0;
  robot::HandshakeOptions options;
  options.may_go_on = [&polls](const robot::ControllerStatus&) -> bool {
    if (++polls > 6) throw std::runtime_error("kill -9");
    return true;
  };
  EXPECT_THROW(run_cycle(*cell.client, cell.clock, order, options), std::runtime_error);
  EXPECT_EQ(read_record(*cell.client, cell.clock, 1).state, CycleState::under_way);
  EXPECT_EQ(finish_cycle(*cell.client, cell.clock, 1), CycleResult::done);
  EXPECT_EQ(cell.machine.moves().size(), 3u);
}

TEST_P(Handshake, SurvivesRandomFaultsWithoutADoubleMotion) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    Cell cell(GetParam(), test::all_faults(0.03 * static_cast<double>(seed), seed));
    const auto counts = test::run_handshakes(
        *cell.client, cell.clock, cell.machine, 100, seed, [](auto&& work) { work(); }, /*trouble_rate=*/0.1);
    EXPECT_EQ(counts.double_motions, 0);
    EXPECT_EQ(counts.missing_motions, 0);
    EXPECT_EQ(counts.wrong_positions, 0);
    EXPECT_EQ(counts.hangs, 0);
    EXPECT_GT(counts.done, 90);
  }
}

TEST(HandshakeOfArm2, UsesVariablesOfItsOwn) {
  MachineOptions behaviour;
  behaviour.on_output = [](Machine& m, int output, bool on) {
    if (output == 2) m.set_input(2, on);
  };
  Machine machine(behaviour);
  std::ifstream file(std::string(TRIBIN_SOURCE_DIR) + "/examples/robots/BPICK2.JBI", std::ios::binary);
  machine.add_job(parse_job(std::string(std::istreambuf_iterator<char>(file), {}), "BPICK2.JBI"));
  ASSERT_EQ(machine.start("BPICK2"), 0);
  Wire wire(machine, {});
  VirtualClock clock;
  const auto client = robot::make_nx100(virtual_stream(wire, clock), clock);
  robot::HandshakeOptions options;
  options.variables = {10, 10, 20};
  std::mt19937_64 random(1);
  for (const robot::Zone zone : {robot::Zone::bin, robot::Zone::rack}) hand_zone(*client, clock, zone, 2);
  for (int cycle = 1; cycle <= 4; ++cycle)
    EXPECT_EQ(run_cycle(*client, clock, test::random_order(cycle, random), options), CycleResult::done);
  EXPECT_EQ(machine.integers[12], 4);
  EXPECT_EQ(machine.integers[2], 0);
  EXPECT_EQ(machine.moves().front().index, 21);
}

/// A controller with both arms' jobs, whose grips hold.
struct TwoArmedCell {
  TwoArmedCell() {
    for (const int arm : {1, 2}) machine.add_job(parse_job(handshake_job_of_arm(arm), "BPICK"));
    machine.add_job(parse_job(waist_job(), "TWAIST"));
    machine.start("BPICK1");
    machine.run_beside("BPICK2");
    options[1].variables = {10, 10, 20};
  }
  Machine machine{[] {
    MachineOptions behaviour;
    behaviour.on_output = [](Machine& m, int output, bool on) { m.set_input(output, on); };
    return behaviour;
  }()};
  Wire wire{machine, {}};
  VirtualClock clock;
  std::unique_ptr<robot::Controller> client = robot::make_nx100(virtual_stream(wire, clock), clock);
  robot::HandshakeOptions options[2];
};

TEST(TwoArmedHandshake, NoJobGoesWhereAnotherArmIs) {
  TwoArmedCell cell;
  std::mt19937_64 random(1);
  robot::CycleOrder order = test::random_order(1, random);
  order.command = robot::CycleCommand::pick;
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order, cell.options[0]), CycleResult::fault);  // nobody's
  hand_zone(*cell.client, cell.clock, robot::Zone::bin, 2);
  EXPECT_THROW(hand_zone(*cell.client, cell.clock, robot::Zone::bin, 1), ControllerError);
  order.cycle = 2;
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order, cell.options[0]), CycleResult::fault);
  EXPECT_TRUE(cell.machine.moves().empty());
  hand_zone(*cell.client, cell.clock, robot::Zone::bin, 0);
  hand_zone(*cell.client, cell.clock, robot::Zone::bin, 1);
  order.cycle = 3;
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order, cell.options[0]), CycleResult::done);
}

TEST(TwoArmedHandshake, ArmsMoveAtTheSameTime) {
  TwoArmedCell cell;
  std::mt19937_64 random(1);
  hand_zone(*cell.client, cell.clock, robot::Zone::bin, 1);
  hand_zone(*cell.client, cell.clock, robot::Zone::rack, 2);
  robot::CycleOrder pick = test::random_order(1, random), place = test::random_order(1, random);
  pick.command = robot::CycleCommand::pick, place.command = robot::CycleCommand::place;
  cell.machine.set_input(2, true);  // it holds a part
  begin_cycle(*cell.client, cell.clock, pick, cell.options[0]);
  begin_cycle(*cell.client, cell.clock, place, cell.options[1]);
  const double begun = cell.clock.now_s();
  double over[2] = {0, 0};
  while (over[0] == 0 || over[1] == 0) {
    for (const int arm : {0, 1})
      if (over[arm] == 0 && look_at_cycle(*cell.client, cell.clock, 1, cell.options[arm]))
        over[arm] = cell.clock.now_s();
    cell.clock.sleep_s(0.05);
  }
  const auto of_arm = [&](int arm) {
    std::vector<double> begins;
    for (const MoveRecord& move : cell.machine.moves())
      if (move.arm == arm) begins.push_back(move.time_s);
    return begins;
  };
  ASSERT_EQ(of_arm(1).size(), 3u);
  ASSERT_EQ(of_arm(2).size(), 3u);
  EXPECT_LT(of_arm(2).front(), of_arm(1).back());
  EXPECT_LT(of_arm(1).front(), of_arm(2).back());
  EXPECT_GT(over[0] - begun, 0);
  // Each is where it was sent; the controller tells of both.
  EXPECT_NEAR(cell.client->position(1, 1).numbers[0], pick.positions.back().numbers[0], 0.01);
  EXPECT_NEAR(cell.client->position(1, 2).numbers[0], place.positions.back().numbers[0], 0.01);
  EXPECT_NEAR(cell.client->position(1, 1).numbers[0], pick.positions.back().numbers[0], 0.01);
}

TEST(TwoArmedHandshake, AHoldStopsBothAndBothGoOn) {
  TwoArmedCell cell;
  std::mt19937_64 random(2);
  hand_zone(*cell.client, cell.clock, robot::Zone::bin, 1);
  hand_zone(*cell.client, cell.clock, robot::Zone::rack, 2);
  robot::CycleOrder pick = test::random_order(1, random), place = test::random_order(1, random);
  pick.command = robot::CycleCommand::pick, place.command = robot::CycleCommand::place;
  cell.machine.set_input(2, true);
  begin_cycle(*cell.client, cell.clock, pick, cell.options[0]);
  begin_cycle(*cell.client, cell.clock, place, cell.options[1]);
  cell.machine.hold(true);
  const auto first = cell.machine.position(1).numbers, second = cell.machine.position(2).numbers;
  cell.machine.advance(cell.clock.now_s() + 5);
  EXPECT_EQ(cell.machine.position(1).numbers, first);
  EXPECT_EQ(cell.machine.position(2).numbers, second);
  cell.machine.hold(false);
  ASSERT_EQ(cell.machine.start(""), 0);
  EXPECT_EQ(finish_cycle(*cell.client, cell.clock, 1, cell.options[0]), CycleResult::done);
  EXPECT_EQ(finish_cycle(*cell.client, cell.clock, 1, cell.options[1]), CycleResult::done);
  EXPECT_EQ(cell.machine.moves().size(), 6u);  // what was stopped is no second move
}

TEST(TwoArmedHandshake, TheWaistTurnsForItsOwnerAndWhileNobodyIsAtWorkAlone) {
  TwoArmedCell cell;
  robot::CycleOrder order;
  order.command = robot::CycleCommand::turn_waist;
  order.waist_rad = -35 * kDegree;
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order, cell.options[0]), CycleResult::done);
  EXPECT_EQ(cell.machine.integers[robot::kWaistIs], -350);
  hand_zone(*cell.client, cell.clock, robot::Zone::rack, 2);
  order.cycle = 2, order.waist_rad = 0;
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order, cell.options[0]), CycleResult::fault);
  EXPECT_EQ(cell.machine.integers[robot::kWaistIs], -350);
  robot::HandshakeOptions impatient = cell.options[1];
  impatient.take_s = 1;
  EXPECT_THROW(run_cycle(*cell.client, cell.clock, order, impatient), ControllerError);  // arm 2 has no such command
}

TEST(HandshakeBehindTheGate, RunsWithConsentAndNotOutsideTheWorkspace) {
  Cell cell("nx100");
  robot::SafetyLimits limits;
  limits.allow_arm = true;
  limits.workspace = robot::Box{Vec3(300, -400, 0), Vec3(900, 400, 600)};
  limits.tools = {1};
  const auto guarded = robot::make_guarded(std::move(cell.client), limits, /*arm=*/true);
  auto order = test::random_order(1, cell.random);
  EXPECT_EQ(run_cycle(*guarded, cell.clock, order), CycleResult::done);
  order.cycle = 2;
  order.positions[1].numbers[2] = -5;
  EXPECT_THROW(run_cycle(*guarded, cell.clock, order), ControllerError);
  EXPECT_EQ(cell.machine.moves().size(), 3u);
}

TEST(HandshakeJudge, SeesTheSecondMotionOfAClientThatSendsAgain) {
  Cell cell("nx100");
  // The job without its own guard, and a client that takes silence for a loss.
  std::string job = handshake_job();
  for (std::size_t at; (at = job.find("JUMP *STALE IF I000=I002\n")) != std::string::npos;) job.erase(at, 25);
  cell.machine.add_job(parse_job(job, "BPICK"));
  cell.machine.hold(true);
  cell.machine.hold(false);
  cell.machine.start("BPICK");
  const auto order = test::random_order(1, cell.random);
  EXPECT_EQ(run_cycle(*cell.client, cell.clock, order), CycleResult::done);
  cell.client->write_byte(0, 1);
  cell.clock.sleep_s(20);
  cell.client->status();
  test::CampaignCounts counts;
  test::MotionJudge(cell.machine).judge(order, true, counts);
  EXPECT_EQ(counts.double_motions, 3);
}

INSTANTIATE_TEST_SUITE_P(Protocols, Handshake, testing::Values("nx100", "hses"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace tribin
