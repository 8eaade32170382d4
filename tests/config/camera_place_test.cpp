#include <gtest/gtest.h>

#include "tribin/config/work_cell.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

constexpr std::int64_t kNow = 1'795'345'000'000;

WorkCell hand_cell() {
  WorkCell cell;
  cell.file = "cell.toml";
  cell.camera.emplace();
  cell.camera->file = "camera.json";
  cell.camera->mount = CameraMount::hand;
  cell.hand_eye.parent_from_camera.translation() = Vec3(0, 50, 100);
  return cell;
}

/// A scan of two seconds ago, whose pose was told a second later.
Taken good() {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3(600, 0, 900);
  return {kNow - 2000, pose, kNow - 1000};
}

/// Code of the refusal, 0 where there is none.
int refusal(const WorkCell& cell, const Taken& taken, std::optional<std::int64_t> now = kNow) {
  try {
    base_from_camera(cell, taken, "scan.pcd", now);
    return 0;
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find("scan.pcd: saw "), 0u) << e.what();
    return static_cast<int>(e.code());
  }
}

TEST(CameraPlace, OfTheFlangeThatCarriesIt) {
  EXPECT_EQ(base_from_camera(hand_cell(), good(), "scan.pcd", kNow).translation(), Vec3(600, 50, 1000));
}

TEST(CameraPlace, EachRefusalOfACameraOnTheFlange) {
  Taken taken = good();
  taken.base_from_flange.reset();
  EXPECT_EQ(refusal(hand_cell(), taken), 3);
  taken = good();
  taken.time_ms.reset();
  EXPECT_EQ(refusal(hand_cell(), taken), 3);
  taken = good();
  taken.flange_time_ms.reset();
  EXPECT_EQ(refusal(hand_cell(), taken), 3);
  taken = good();
  taken.flange_time_ms = *taken.time_ms - 1;
  EXPECT_EQ(refusal(hand_cell(), taken), 5);
  EXPECT_EQ(refusal(hand_cell(), taken, {}), 5);  // also where nothing moves
  taken.flange_time_ms = taken.time_ms;
  EXPECT_EQ(refusal(hand_cell(), taken), 0);
}

TEST(CameraPlace, OldScansMoveNothing) {
  WorkCell fixed = hand_cell();
  fixed.camera->mount = CameraMount::fixed;
  for (const WorkCell& cell : {hand_cell(), fixed}) {
    EXPECT_EQ(refusal(cell, good(), kNow + 8000), 0);
    EXPECT_EQ(refusal(cell, good(), kNow + 8001), 5);
    EXPECT_EQ(refusal(cell, good(), kNow - 2000 - 1001), 5);  // from the future
    EXPECT_EQ(refusal(cell, good(), {}), 0);                  // age is asked for motion only
    EXPECT_EQ(refusal(cell, Taken{}), 3);
  }
  EXPECT_EQ(refusal(fixed, Taken{}, {}), 0);
}

}  // namespace
}  // namespace tribin
