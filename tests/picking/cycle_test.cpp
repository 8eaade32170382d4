#include "tribin/picking/cycle.hpp"

#include <gtest/gtest.h>

#include "support/fake_cell.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/robot/nx100.hpp"

namespace tribin::picking {
namespace {

using test::FakeTruth;
using test::FakeVision;

/// The fake cell with a controller on a clock that only waiting moves.
struct Bench {
  explicit Bench(int parts, WorkCell work_cell = test::fake_work_cell())
      : cell(std::move(work_cell)),
        robot(read_robot(cell.robots.front().model)),
        truth(cell, parts),
        machine(truth.machine_options()),
        wire(machine, {{}, 0, 1, 2, 30, 5}),
        vision(robot, [this] { return truth.in_bin; }),
        limits(test::fake_limits(cell)) {
    machine.add_job(controller_sim::parse_job(controller_sim::handshake_job(), "BPICK"));
    machine.start("BPICK");
  }

  RunEnd run(RunOptions options = {}) {
    if (machine.status().held_by_command) {  // a program that ends leaves the robot held; the operator lets it go on
      machine.hold(false);
      machine.start("");
    }
    const auto controller =
        robot::make_guarded(robot::make_nx100(controller_sim::virtual_stream(wire, clock), clock), limits, true);
    Journal journal(folder.path() / "rack.ndjson", slots_of(*cell.rack).size());
    options.told = [this](const CycleReport& report) { told.push_back(report); };
    const RunEnd end = run_picking({&cell, &robot, &vision, controller.get(), &clock, &journal, limits}, options);
    filling = journal.state().filling;
    return end;
  }
  int count(const std::string& state) const {
    return static_cast<int>(
        std::count_if(told.begin(), told.end(), [&](const CycleReport& report) { return report.state == state; }));
  }
  void expect_truth_is_as_told() const {
    for (std::size_t i = 0; i < filling.size(); ++i) {
      EXPECT_LE(truth.rack[i].size(), 1u);
      EXPECT_EQ(truth.rack[i].empty() ? "" : truth.rack[i].front(), filling[i]);
    }
    EXPECT_EQ(truth.lost, 0);
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

TEST(Cycle, FillsTheRackInItsPattern) {
  Bench bench(8);
  const RunEnd end = bench.run();
  EXPECT_EQ(end.status, "rack_full");
  EXPECT_EQ(end.placed, 6);
  EXPECT_EQ(bench.filling, (Filling{"a", "b", "a", "b", "a", "b"}));
  bench.expect_truth_is_as_told();
}

TEST(Cycle, AnEmptyBinEndsIt) {
  Bench bench(4);
  EXPECT_EQ(bench.run().status, "empty");
  EXPECT_EQ(bench.count("placed"), 4);
  bench.expect_truth_is_as_told();
}

TEST(Cycle, StopsAfterSoManyPartsAndGoesOnLater) {
  Bench bench(6);
  RunOptions options;
  options.most_parts = 2;
  EXPECT_EQ(bench.run(options).status, "most_parts");
  EXPECT_EQ(bench.run(options).status, "most_parts");
  EXPECT_EQ(bench.count("placed"), 4);
  EXPECT_EQ(bench.run().status, "rack_full");
  bench.expect_truth_is_as_told();
}

TEST(Cycle, AGraspThatFailedIsNotTriedAgainAtOnce) {
  Bench bench(6);
  bench.truth.slippery = {0, 1, 0};
  EXPECT_EQ(bench.run().status, "rack_full");
  EXPECT_EQ(bench.count("missed"), 3);
  int last = -1;
  for (const CycleReport& report : bench.told) {
    const int part = static_cast<int>(std::lround((report.base_from_part.translation().x() - 1100) / 70));
    if (report.state == "missed") {
      EXPECT_NE(part, last);
      last = part;
    } else {
      last = -1;
    }
  }
  bench.expect_truth_is_as_told();
}

TEST(Cycle, ASlotIsSkippedOrWaitedFor) {
  WorkCell cell = test::fake_work_cell();
  for (const auto& [when, status, placed] :
       {std::tuple{WhenMissing::skip, "empty", 1}, std::tuple{WhenMissing::wait, "part_missing", 0}}) {
    cell.rack->when_missing = when;
    Bench bench(2, cell);
    bench.truth.in_bin[0] = false;  // the first slot's part is not there
    EXPECT_EQ(bench.run().status, status);
    EXPECT_EQ(bench.count("placed"), placed);
    bench.expect_truth_is_as_told();
  }
}

TEST(Cycle, ResortsComeInTheirOrder) {
  WorkCell cell = test::fake_work_cell();
  cell.grippers.push_back(cell.grippers.front());
  cell.grippers.back().name = "other";
  Bench bench(2, cell);
  bench.vision.hard = {{0, true}};
  bench.vision.buried = {1};
  EXPECT_EQ(bench.run().status, "empty");
  ASSERT_EQ(bench.count("placed"), 2);
  EXPECT_EQ(bench.told[0].resort, Resort::full_tilt);
  const auto& asked = bench.vision.asked;
  ASSERT_GE(asked.size(), 3u);
  EXPECT_EQ(asked[0].grippers, std::vector<std::string>{"jaw"});
  EXPECT_TRUE(asked[0].max_tilt_rad);
  EXPECT_TRUE(asked[1].grippers.empty());
  EXPECT_TRUE(asked[1].max_tilt_rad);
  EXPECT_FALSE(asked[2].max_tilt_rad);
  EXPECT_EQ(bench.count("pushed"), 1);
  bench.expect_truth_is_as_told();
}

TEST(Cycle, ACameraOnTheFlangeLooksFromItsPlaces) {
  WorkCell cell = test::fake_work_cell();
  cell.camera.emplace();
  cell.camera->mount = CameraMount::hand;
  for (const double x : {1000.0, 1100.0, 1200.0}) cell.camera->looks.push_back(test::looking_down(Vec3(x, 100, 900)));
  Bench bench(4, cell);
  bench.vision.shadowed = {{1, 1050}, {2, 1150}};
  EXPECT_EQ(bench.run().status, "empty");
  EXPECT_EQ(bench.count("placed"), 4);
  ASSERT_EQ(bench.vision.looked_from.size(), static_cast<std::size_t>(bench.vision.scans));
  const auto is_look = [&](const Vec3& at) {
    return std::any_of(cell.camera->looks.begin(), cell.camera->looks.end(),
                       [&](const Pose& look) { return (look.translation() - at).norm() < 0.1; });
  };
  // The first place is the usual one; a part that is placed leads back to it, and no part waits for a push.
  EXPECT_NEAR(bench.vision.looked_from.front().x(), 1000, 0.1);
  EXPECT_NEAR(bench.vision.looked_from.back().x(), 1000, 0.1);
  for (const Vec3& at : bench.vision.looked_from) EXPECT_TRUE(is_look(at)) << at.transpose();
  EXPECT_EQ(std::count_if(bench.told.begin(), bench.told.end(),
                          [](const CycleReport& report) {
                            return report.state == "placed" && report.resort == Resort::next_look;
                          }),
            2);
  EXPECT_EQ(bench.count("pushed"), 0);
  bench.expect_truth_is_as_told();
}

TEST(Cycle, ACameraOnTheFlangeWantsToKnowWhereToLookFrom) {
  WorkCell cell = test::fake_work_cell();
  cell.camera.emplace();
  cell.camera->mount = CameraMount::hand;
  Bench bench(1, cell);
  EXPECT_THROW(bench.run(), Error);
}

TEST(Cycle, FivePushesInVainAndItAsks) {
  Bench bench(1);
  bench.vision.buried = {0};
  bench.vision.pushes_to_free = 100;
  const RunEnd end = bench.run();
  EXPECT_EQ(end.status, "not_pickable");
  EXPECT_EQ(bench.count("pushed"), 5);
  EXPECT_EQ(bench.vision.scans, 6);  // one push a scan
  EXPECT_EQ(bench.truth.grips, 0);
}

TEST(Cycle, ATightSlotIsRefusedWithItsReason) {
  WorkCell cell = test::fake_work_cell();
  cell.rack->chamfer_mm = 0.5;
  Bench bench(2, cell);
  const RunEnd end = bench.run();
  EXPECT_EQ(end.status, "not_pickable");
  EXPECT_NE(end.message.find("saw a chamfer of 0.50 mm, wanted at least"), std::string::npos) << end.message;
  EXPECT_EQ(bench.truth.grips, 0);
}

TEST(Cycle, ASlotThatTheScanDoesNotShowEmptyIsLeft) {
  WorkCell cell = test::fake_work_cell();
  const std::vector<Slot> slots = slots_of(*cell.rack);
  for (const RoomSeen seen : {RoomSeen::occupied, RoomSeen::hidden}) {
    cell.rack->check_by_scan = false;
    Bench trusting(8, cell);
    trusting.vision.rooms = {{slots[0].base_from_slot.translation(), seen}};
    EXPECT_EQ(trusting.run().placed, 6);
    cell.rack->check_by_scan = true;
    Bench bench(8, cell);
    bench.vision.rooms = {{slots[0].base_from_slot.translation(), seen}};
    const RunEnd end = bench.run();
    EXPECT_EQ(end.placed, 5);
    EXPECT_TRUE(bench.truth.rack[0].empty());
    EXPECT_EQ(end.status, "not_pickable");
    EXPECT_NE(end.message.find("slot_occupied: the scan "), std::string::npos) << end.message;
    EXPECT_NE(end.message.find("slot 1 (a)"), std::string::npos) << end.message;
    bench.expect_truth_is_as_told();
  }
}

/// The order to pick part b for slot 2.
Entry order_of_next(const Journal& journal) {
  Entry entry;
  entry.event = Event::pick_ordered;
  entry.cycle = journal.state().last_cycle + 1;
  entry.part = "b", entry.gripper = "jaw", entry.slot = 2;
  return entry;
}

TEST(Cycle, WhereTheControllerCannotTellItAsks) {
  Bench bench(6);
  RunOptions options;
  options.most_parts = 1;
  bench.run(options);
  {  // ordered, and then the controller lost its variables
    Journal journal(bench.folder.path() / "rack.ndjson", 6);
    Entry entry = order_of_next(journal);
    journal.write(entry);
    entry.event = Event::picked;
    journal.write(entry);
    entry.event = Event::place_ordered;
    ++entry.cycle;
    journal.write(entry);
  }
  bench.machine.integers[1] = bench.machine.integers[2] = 0;
  const RunEnd end = bench.run();
  EXPECT_EQ(end.status, "in_doubt");
  EXPECT_NE(end.message.find("slot 2"), std::string::npos) << end.message;
  EXPECT_EQ(bench.truth.grips, 1);  // nothing moved
  RunOptions answered;
  answered.answer = Answer::slot_full;
  EXPECT_EQ(bench.run(answered).status, "rack_full");
  EXPECT_TRUE(bench.truth.rack[1].empty());  // it believed the operator, and put nothing there
}

TEST(Cycle, AnOrderThatWasNeverTakenIsForgotten) {
  Bench bench(6);
  RunOptions options;
  options.most_parts = 1;
  bench.run(options);
  {
    Journal journal(bench.folder.path() / "rack.ndjson", 6);
    journal.write(order_of_next(journal));
  }
  EXPECT_EQ(bench.run().status, "rack_full");
  bench.expect_truth_is_as_told();
}

TEST(Cycle, NothingMovesByACalibrationThatIsSuspect) {
  Bench bench(3);
  bench.vision.suspect = "the bin is 9 mm from its place";
  const RunEnd end = bench.run();
  EXPECT_EQ(end.status, "calibration_suspect");
  EXPECT_EQ(end.message, bench.vision.suspect);
  EXPECT_EQ(bench.truth.grips, 0);
  EXPECT_TRUE(bench.machine.moves().empty());
}

TEST(Cycle, ADryRunMovesNothing) {
  Bench bench(3);
  const CycleReport report = plan_first(bench.cell, bench.robot, bench.vision, Filling(6), bench.limits);
  EXPECT_EQ(report.state, "planned");
  EXPECT_EQ(report.slot, 1);
  EXPECT_EQ(bench.truth.grips, 0);
}

}  // namespace
}  // namespace tribin::picking
