#include <gtest/gtest.h>

#include <random>

#include "support/fake_cell.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/robot/nx100.hpp"

namespace tribin::picking {
namespace {

using test::FakeTruth;
using test::FakeVision;

/// The fake cell with an arm on either side of bin and rack, or two arms on a waist that looks away from them.
WorkCell two_armed_cell() {
  WorkCell cell = test::fake_work_cell();
  cell.robots.front().model = std::string(TRIBIN_SOURCE_DIR) + "/examples/robots/two_gp110.toml";
  cell.robots.push_back(cell.robots.front());
  cell.grippers.push_back(cell.grippers.front());
  cell.grippers.back().name = "jaw_2";
  cell.robots[0].arm = "R1", cell.robots[0].grippers = {"jaw"};
  cell.robots[1].arm = "R2", cell.robots[1].grippers = {"jaw_2"};
  cell.robots[0].wait = test::looking_down(Vec3(700, -500, 700));
  cell.robots[1].wait = test::looking_down(Vec3(1800, -500, 700));
  cell.safety.workspace_mm = CellRange{Vec3(-1500, -1500, 0), Vec3(4000, 2000, 1500)};
  return cell;
}

struct TwoArmedBench {
  explicit TwoArmedBench(int parts, WorkCell work_cell = two_armed_cell())
      : cell(std::move(work_cell)),
        robot(read_robot(cell.robots.front().model)),
        truth(cell, parts),
        machine(truth.machine_options()),
        wire(machine, {{}, 0, 1, 2, 30, 5}),
        vision(robot, [this] { return truth.in_bin; }),
        limits(test::fake_limits(cell)) {
    for (const int arm : {1, 2}) {
      machine.add_job(controller_sim::parse_job(controller_sim::handshake_job_of_arm(arm), "BPICK"));
      machine.place(
          robot::position_from_pose(*cell.robots[arm - 1].wait * cell.grippers[arm - 1].flange_from_tcp, 0, arm, 0),
          arm);
    }
    machine.add_job(controller_sim::parse_job(controller_sim::waist_job(), "TWAIST"));
    machine.start("BPICK1");
    machine.run_beside("BPICK2");
  }

  RunEnd run(RunOptions options = {}) {
    if (machine.status().held()) {  // the operator lets it go on
      machine.hold(false);
      machine.start("");
    }
    const auto controller =
        robot::make_guarded(robot::make_nx100(controller_sim::virtual_stream(wire, clock), clock), limits, true);
    Journal journal(folder.path() / "rack.ndjson", slots_of(*cell.rack).size());
    options.told = [this](const CycleReport& report) { told.push_back(report); };
    try {
      const RunEnd end = run_picking({&cell, &robot, &vision, controller.get(), &clock, &journal, limits}, options);
      filling = journal.state().filling;
      return end;
    } catch (const Error&) {
      filling = journal.state().filling;
      throw;
    }
  }
  void expect_truth_is_as_told() const {
    for (std::size_t i = 0; i < filling.size(); ++i) {
      EXPECT_LE(truth.rack[i].size(), 1u);
      EXPECT_EQ(truth.rack[i].empty() ? "" : truth.rack[i].front(), filling[i]);
    }
    EXPECT_EQ(truth.lost, 0);
  }
  int byte(robot::Zone zone) const {
    const auto at = machine.bytes.find(static_cast<int>(zone));
    return at == machine.bytes.end() ? 0 : at->second;
  }

  WorkCell cell;
  robot::RobotModel robot;
  FakeTruth truth;
  controller_sim::Machine machine;
  controller_sim::Wire wire;
  controller_sim::VirtualClock clock;
  FakeVision vision;
  robot::SafetyLimits limits;
  test::TemporaryFolder folder;
  std::vector<CycleReport> told;
  Filling filling;
};

TEST(TwoArms, FillTheRackInItsPatternTurnByTurn) {
  TwoArmedBench bench(8);
  const RunEnd end = bench.run();
  EXPECT_EQ(end.status, "rack_full") << end.message;
  EXPECT_EQ(end.placed, 6);
  EXPECT_EQ(bench.filling, (Filling{"a", "b", "a", "b", "a", "b"}));
  bench.expect_truth_is_as_told();
  int placed[3] = {0, 0, 0};
  for (const CycleReport& report : bench.told) placed[report.arm] += report.state == "placed";
  EXPECT_GT(placed[1], 1);
  EXPECT_GT(placed[2], 1);
  for (const robot::Zone zone : {robot::Zone::bin, robot::Zone::rack}) EXPECT_EQ(bench.byte(zone), 0);
  // One is at work in the bin while the other is at the rack.
  const auto& moves = bench.machine.moves();
  int overlaps = 0;
  for (std::size_t i = 0; i + 1 < moves.size(); ++i) overlaps += moves[i].arm != moves[i + 1].arm;
  EXPECT_GT(overlaps, 6);
}

TEST(TwoArms, AMissedGripIsNoneOfTheOthers) {
  TwoArmedBench bench(6);
  bench.truth.slippery = {0, 3};
  EXPECT_EQ(bench.run().status, "rack_full");
  EXPECT_EQ(std::count_if(bench.told.begin(), bench.told.end(),
                          [](const CycleReport& report) { return report.state == "missed"; }),
            2);
  bench.expect_truth_is_as_told();
}

/// The supervision stops it at any poll: the robot is held, the program ends, another one goes on.
TEST(TwoArms, GoOnWhereverTheyWereStopped) {
  for (int seed = 0; seed < 20; ++seed) {
    TwoArmedBench bench(6);
    std::mt19937 random(static_cast<unsigned>(seed));
    RunEnd end;
    for (int runs = 0; runs < 12 && end.status != "rack_full"; ++runs) {
      int left = std::uniform_int_distribution<>(1, 400)(random);
      RunOptions options;
      options.handshake.may_go_on = [&left](const robot::ControllerStatus&) { return --left != 0; };
      try {
        end = bench.run(options);
        ASSERT_NE(end.status, "in_doubt") << "seed " << seed << ": " << end.message;
      } catch (const Error&) {  // stopped
      }
    }
    if (end.status != "rack_full") end = bench.run();
    EXPECT_EQ(end.status, "rack_full") << "seed " << seed << ": " << end.message;
    EXPECT_EQ(bench.filling, (Filling{"a", "b", "a", "b", "a", "b"})) << "seed " << seed;
    bench.expect_truth_is_as_told();
  }
}

TEST(TwoArms, AnArmAwayFromItsPlaceWithoutAZoneIsAskedFor) {
  TwoArmedBench bench(6);
  robot::CartesianPosition elsewhere = bench.machine.position(2);
  elsewhere.numbers[1] += 300;
  bench.machine.place(elsewhere, 2);
  const RunEnd end = bench.run();
  EXPECT_EQ(end.status, "in_doubt");
  EXPECT_NE(end.message.find("arm 2 does not stand where it waits"), std::string::npos) << end.message;
  EXPECT_TRUE(bench.machine.moves().empty());
}

TEST(TwoArms, TheWaistIsTurnedOnceToWhereBothReachTheBin) {
  WorkCell cell = two_armed_cell();
  for (CellRobot& robot : cell.robots) {
    robot.model = std::string(TRIBIN_SOURCE_DIR) + "/examples/robots/sda20d.toml";
    robot.wait = test::looking_down(Vec3(500, robot.arm == "R1" ? 800 : -800, 350));
  }
  // Aside of where the robot looks: at 0 the second arm does not reach all of it.
  cell.bin = CellBin{};
  cell.bin->base_from_bin.translation() = Vec3(450, 500, 0);
  cell.bin->inner_size_mm = Vec3(300, 300, 100);
  cell.rack->base_from_rack.translation() = Vec3(100, 700, 60);
  TwoArmedBench bench(0, cell);
  EXPECT_EQ(bench.run().status, "empty");
  const int turned = bench.machine.integers[robot::kWaistIs];
  EXPECT_GT(turned, 100);  // [0.1 deg]
  EXPECT_LT(turned, 1200);
  EXPECT_EQ(bench.machine.integers[2], 1);  // one cycle of its owner, none of the other arm
  EXPECT_EQ(bench.machine.integers[12], 0);
}

TEST(TwoArms, WantWhereToWaitAndWhichGrippers) {
  WorkCell cell = two_armed_cell();
  cell.robots[1].wait.reset();
  EXPECT_THROW(TwoArmedBench(1, cell).run(), Error);
  cell = two_armed_cell();
  cell.robots[1].grippers = {"jaw"};
  EXPECT_THROW(TwoArmedBench(1, cell).run(), Error);
}

}  // namespace
}  // namespace tribin::picking
