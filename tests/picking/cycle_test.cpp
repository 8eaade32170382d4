#include "tribin/picking/cycle.hpp"

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

WorkCell cell_that_shows() {
  WorkCell cell = test::fake_work_cell();
  cell.in_hand = InHand{{test::looking_down(Vec3(1000, 300, 700))}};
  return cell;
}

/// What a camera would see of a part that slipped by that much, with errors of so much a direction.
HandSight seen_in_hand(const HandView& view, const Vec3& slipped, double sigma_mm) {
  HandSight sight;
  sight.state = HandSight::State::measured;
  sight.look.base_from_tcp = view.base_from_tcp;
  sight.look.base_from_part = view.base_from_tcp * view.tcp_from_part;
  sight.look.base_from_part.translation() += slipped;
  sight.look.covariance.diagonal() << Vec3::Constant(sigma_mm * sigma_mm), Vec3::Constant(1e-6);
  return sight;
}

TEST(Cycle, WhatIsMeasuredInTheHandIsPlacedBetter) {
  constexpr double kSlip_mm = 0.15, kSeen_mm = 0.015;  // a direction
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    double mean[2] = {0, 0};
    for (const bool shows : {false, true}) {
      WorkCell cell = shows ? cell_that_shows() : test::fake_work_cell();
      cell.robots.front().sigma_mm = cell.hand_eye.sigma_mm = 0.02;
      cell.grippers.front().slip_mm = kSlip_mm * std::sqrt(3.0);
      Bench bench(8, cell);
      std::mt19937 random(seed);
      std::normal_distribution<double> normal;
      const auto drawn = [&](double sigma) {
        return Vec3(sigma * Vec3(normal(random), normal(random), normal(random)));
      };
      bench.truth.slip = [&] { return drawn(kSlip_mm); };
      bench.vision.in_hand = [&](const HandView& view) {
        return seen_in_hand(view, bench.truth.slipped + drawn(kSeen_mm), kSeen_mm);
      };
      EXPECT_EQ(bench.run().placed, 6);
      bench.expect_truth_is_as_told();
      EXPECT_EQ(bench.vision.hand_looks, shows ? 6 : 0);
      for (const CycleReport& report : bench.told) {
        EXPECT_EQ(report.in_hand.has_value(), shows);
        if (report.in_hand) {
          EXPECT_TRUE(report.in_hand->measured) << report.in_hand->why;
          EXPECT_LT(report.in_hand->sigma_mm, 0.2);
        }
      }
      for (const double off : bench.truth.off_mm) mean[shows] += off / 6;
    }
    EXPECT_LT(mean[1], 0.5 * mean[0]);
  }
}

TEST(Cycle, WhatIsNotMeasuredInTheHandIsPlacedAsItWasGripped) {
  Bench bench(8, cell_that_shows());
  bench.vision.in_hand = [](const HandView&) {
    HandSight sight;
    sight.why = "it is not seen";
    return sight;
  };
  EXPECT_EQ(bench.run().placed, 6);
  bench.expect_truth_is_as_told();
  for (const CycleReport& report : bench.told) {
    ASSERT_TRUE(report.in_hand);
    EXPECT_FALSE(report.in_hand->measured);
    EXPECT_EQ(report.in_hand->why, "it is not seen");
  }
  for (const double off : bench.truth.off_mm) EXPECT_LT(off, 0.01);
}

TEST(Cycle, AGripThatTheScanContradictsIsNotBelieved) {
  Bench bench(1, cell_that_shows());
  const Vec3 far(0.4, -0.3, 0);  // slip is 0.3 mm
  bench.cell.grippers.front().slip_mm = 0.05, bench.cell.robots.front().sigma_mm = 0.01;
  bench.cell.hand_eye.sigma_mm = 0.01;
  bench.truth.slip = [&] { return far; };
  bench.vision.in_hand = [&](const HandView& view) { return seen_in_hand(view, far, 0.05); };
  EXPECT_EQ(bench.run().placed, 1);
  ASSERT_TRUE(bench.told.front().in_hand);
  EXPECT_EQ(bench.told.front().in_hand->why, "it slipped farther than parts do");
  EXPECT_NEAR(bench.told.front().in_hand->moved_mm, 0.5, 0.01);
  EXPECT_LT(bench.truth.off_mm.front(), 0.02);
}

TEST(Cycle, APartThatIsNotInTheHandIsLost) {
  Bench bench(3, cell_that_shows());
  int looks = 0;
  bench.vision.in_hand = [&](const HandView& view) {
    HandSight sight = seen_in_hand(view, Vec3::Zero(), 0.05);
    if (++looks == 1) sight.state = HandSight::State::gone, bench.truth.held = -1;
    return sight;
  };
  EXPECT_EQ(bench.run().placed, 2);
  EXPECT_EQ(bench.count("lost"), 1);
}

TEST(Cycle, WhatIsHeldTooUnsurelyForItsSlotIsNotPlaced) {
  WorkCell cell = cell_that_shows();
  cell.rack->chamfer_mm = 1;  // less than three times the slip of 0.3 mm and the rest, more than without it
  cell.robots.front().sigma_mm = 0.1, cell.hand_eye.sigma_mm = 0.1;
  for (const bool seen : {true, false}) {
    Bench bench(1, cell);
    bench.vision.in_hand = [&](const HandView& view) {
      HandSight sight = seen_in_hand(view, Vec3::Zero(), 0.02);
      if (!seen) sight.state = HandSight::State::unsure;
      return sight;
    };
    const RunEnd end = bench.run();
    EXPECT_EQ(end.placed, seen ? 1 : 0);
    EXPECT_EQ(end.status, seen ? "empty" : "in_doubt") << end.message;
  }
}

TEST(Cycle, WhatWasMeasuredBeforeACrashIsPlacedSo) {
  WorkCell cell = cell_that_shows();
  cell.robots.front().sigma_mm = cell.hand_eye.sigma_mm = 0.02;
  Bench bench(1, cell);
  const Vec3 slipped(0.3, 0.2, 0);
  bench.truth.slip = [&] { return slipped; };
  bench.vision.in_hand = [&](const HandView& view) { return seen_in_hand(view, slipped, 0.001); };
  for (const Phase crash : {Phase::show, Phase::place}) {
    SCOPED_TRACE(name_of(crash));
    bench.truth.refill(1);
    bench.truth.rack.assign(6, {}), bench.truth.off_mm.clear();
    std::filesystem::remove(bench.folder.path() / "rack.ndjson");
    bench.vision.hand_looks = 0;
    struct Crash {};
    RunOptions options;
    options.entered = [&](Phase phase) {
      if (phase == crash) throw Crash();
    };
    EXPECT_THROW(bench.run(options), Crash);
    EXPECT_EQ(bench.run().placed, 1);
    EXPECT_EQ(bench.vision.hand_looks, 1);
    ASSERT_EQ(bench.truth.off_mm.size(), 1u);
    EXPECT_LT(bench.truth.off_mm.front(), 0.15);
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
