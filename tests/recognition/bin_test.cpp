#include "tribin/recognition/bin.hpp"

#include <gtest/gtest.h>

#include "support/near_symmetric.hpp"
#include "support/posed_scan.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin {
namespace {

const BinShape kShape{{300, 200, 90}, 6};

/// A bin on the table, nearly square to the camera.
Pose bin_pose(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(-1, 1);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0)) *
                  rotation_from_vector(Vec3(6 * kDegree * part(random), 6 * kDegree * part(random), 0)) *
                  rotation_from_vector(Vec3(0, 0, 20 * kDegree * part(random)));
  pose.translation() = Vec3(15 * part(random), 15 * part(random), 650);
  return pose;
}

/// What lies in a bin, in its frame, and the table it stands on.
Scan scan_of_bin(const Pose& camera_from_bin, std::vector<std::pair<const Mesh*, Pose>> in_bin, unsigned seed) {
  static const Mesh mesh = bin_mesh(kShape);
  for (auto& [thing, pose] : in_bin) pose = camera_from_bin * pose;
  in_bin.emplace_back(&mesh, camera_from_bin);
  const Vec3 up = camera_from_bin.linear().col(2);
  return test::posed_scan(in_bin, up, up.dot(camera_from_bin * Vec3(0, 0, -kShape.wall_mm - 1)), 0.1, 0.6, seed, 960,
                          768);
}

Pose at(double x, double y, double z) {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3(x, y, z);
  return pose;
}

BinSighting sight(const Scan& scan, const std::optional<Pose>& given) {
  KnownBin known;
  known.shape = kShape;
  known.camera_from_bin = given;
  const Surfels surfels = surfels_from_scan(scan);
  return find_bin(known, surfels, build_model(segment(surfels), surfels));
}

/// Half a turn about z leaves the bin as it is.
double turned_by(const Pose& a, const Pose& b) {
  const double angle = rotation_angle(a.linear(), b.linear());
  return std::min(angle, kPi - angle);
}

TEST(FindBin, FindsItWhereverItStandsAndTellsHowFull) {
  const Mesh block = test::prism(test::rectangle(40, 30), 40);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Pose truth = bin_pose(seed);
    const int blocks = static_cast<int>(seed) % 3;
    std::vector<std::pair<const Mesh*, Pose>> in_bin;
    for (int k = 0; k < blocks; ++k) in_bin.emplace_back(&block, at(-80 + 100 * k, 20 - 30 * k, 0));
    const BinSighting bin = sight(scan_of_bin(truth, in_bin, seed), {});
    ASSERT_TRUE(bin.found) << bin.reason;
    EXPECT_FALSE(bin.drift_sigma.has_value());
    const Vec3 middle(0, 0, 45);
    EXPECT_LT((bin.camera_from_bin * middle - truth * middle).norm(), 0.3);
    EXPECT_LT(turned_by(bin.camera_from_bin, truth), 0.1 * kDegree);
    const double filled = blocks * 80.0 * 60 * 40 / kShape.inner_size_mm.prod();
    EXPECT_NEAR(bin.fill, filled, 0.03);
    if (blocks == 0) {
      EXPECT_LT(bin.fill, 0.003);
    }
  }
}

TEST(FindBin, AShiftOfThreeMillimetresIsDriftAndNoneIsNot) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Pose truth = bin_pose(seed);
    const Scan scan = scan_of_bin(truth, {}, seed);
    const BinSighting right = sight(scan, truth);
    ASSERT_TRUE(right.found) << right.reason;
    ASSERT_TRUE(right.drift_sigma.has_value());
    EXPECT_LT(*right.drift_sigma, kDriftLimit);
    std::mt19937 random(seed);
    const Vec3 shift = 3 * test::random_direction(random);
    const BinSighting moved = sight(scan, Eigen::Translation3d(Eigen::Vector3d(shift)) * truth);
    ASSERT_TRUE(moved.found) << moved.reason;
    EXPECT_GT(*moved.drift_sigma, kDriftLimit);
    EXPECT_NEAR(moved.drift_mm, 3, 0.3);
  }
}

TEST(FindBin, SaysWhyThereIsNone) {
  const Scan table = test::posed_scan({}, Vec3(0, 0, -1), -660, 0.1, 0.6, 1, 640, 512);
  const BinSighting none = sight(table, {});
  EXPECT_FALSE(none.found);
  EXPECT_FALSE(none.reason.empty());
  const BinSighting given = sight(table, bin_pose(1));
  EXPECT_FALSE(given.found);
  EXPECT_FALSE(given.reason.empty());
}

class FindPartsInBin : public testing::Test {
 protected:
  static const std::vector<Part>& parts() {
    static const std::vector<Part> list = {
        compile_part(test::prism({{-30, -20}, {30, -20}, {30, -2}, {5, 2}, {-5, 20}, {-30, 20}}, 25))};
    return list;
  }
  static Found look(const Scan& scan, const Pose& camera_from_bin, const FinderOptions& from = {}) {
    FinderOptions options = from;
    options.bin = KnownBin{kShape, camera_from_bin, 0, 0};
    return find_parts(scan, parts(), options);
  }
};

TEST_F(FindPartsInBin, AnEmptyBinIsEmpty) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const Found found = look(scan_of_bin(bin_pose(seed), {}, seed), bin_pose(seed));
    EXPECT_EQ(found.status, "empty");
    EXPECT_TRUE(found.instances.unexplained.empty());
    EXPECT_TRUE(found.warnings.empty());
  }
}

TEST_F(FindPartsInBin, AForeignBodyIsARegionWithItsVolume) {
  const Mesh sheet = test::prism(test::rectangle(110, 70), 25);  // larger than any part: without a bin it is background
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const Pose truth = bin_pose(seed);
    const Found found = look(scan_of_bin(truth, {{&sheet, at(10, -5, 0)}}, seed), truth);
    EXPECT_EQ(found.status, "not_empty_no_object");
    ASSERT_EQ(found.instances.unexplained.size(), 1u);
    const UnexplainedRegion& region = found.instances.unexplained[0];
    EXPECT_NEAR(region.volume_mm3, 220 * 140 * 25, 0.1 * 220 * 140 * 25);
    EXPECT_LT((region.center_mm - truth * Vec3(10, -5, 25)).norm(), 4);
    EXPECT_GT(region.pixels, 1000);
  }
}

TEST_F(FindPartsInBin, WhatLiesBesideTheBinIsNoPart) {
  const Mesh& part = parts()[0].mesh;
  const Pose truth = bin_pose(2);
  const double up = kShape.inner_size_mm.z();
  const Scan scan = scan_of_bin(truth, {{&part, at(20, 10, 0)}, {&part, at(0, 135, up)}}, 2);
  const Found found = look(scan, truth);
  ASSERT_EQ(found.instances.items.size() + found.instances.uncertain.size(), 1u);
  const Instance& instance = found.instances.items.empty() ? found.instances.uncertain[0] : found.instances.items[0];
  EXPECT_LT((instance.camera_from_part.translation() - truth * Vec3(20, 10, 0)).norm(), 1);
  EXPECT_TRUE(found.instances.unexplained.empty());
}

TEST_F(FindPartsInBin, TheSameWorkGivesTheSameAnswer) {
  const Mesh& part = parts()[0].mesh;
  const Pose truth = bin_pose(3);
  const Scan scan = scan_of_bin(truth, {{&part, at(-70, 30, 0)}, {&part, at(60, -20, 0)}}, 3);
  const Found all = look(scan, truth);
  ASSERT_EQ(all.instances.items.size(), 2u);
  EXPECT_FALSE(all.instances.time_limit);
  FinderOptions options;
  options.work_limit = all.instances.work_done;
  const Found again = look(scan, truth, options);
  EXPECT_FALSE(again.instances.time_limit);
  EXPECT_EQ(again.instances.items.size(), 2u);
  // Each unit less is a prefix of the same search: never more parts, and the last one stops nothing.
  std::size_t before = 0;
  for (int limit = 1; limit <= all.instances.work_done; ++limit) {
    options.work_limit = limit;
    const Found some = look(scan, truth, options);
    EXPECT_EQ(some.instances.work_done, limit);
    EXPECT_EQ(some.instances.time_limit, limit < all.instances.work_done);
    EXPECT_GE(some.instances.items.size(), before);
    before = some.instances.items.size();
  }
}

TEST_F(FindPartsInBin, AReplayOfATimedRunEndsAsIt) {
  const Mesh& part = parts()[0].mesh;
  const Pose truth = bin_pose(4);
  const Scan scan = scan_of_bin(truth, {{&part, at(-70, 30, 0)}, {&part, at(60, -20, 0)}}, 4);
  for (const int limit_ms : {1, 150, 100000}) {
    SCOPED_TRACE(limit_ms);
    FinderOptions timed;
    timed.time_limit_ms = limit_ms;
    const Found first = look(scan, truth, timed);
    FinderOptions counted;
    // A run without any work cannot be asked for: 0 is no limit.
    if (first.instances.work_done == 0) {
      EXPECT_EQ(first.status, "time_limit");
      EXPECT_TRUE(first.instances.items.empty());
      continue;
    }
    counted.work_limit = first.instances.work_done;
    const Found again = look(scan, truth, counted);
    EXPECT_EQ(again.status, first.status);
    ASSERT_EQ(again.instances.items.size(), first.instances.items.size());
    for (std::size_t i = 0; i < again.instances.items.size(); ++i)
      EXPECT_TRUE(again.instances.items[i].camera_from_part.matrix() ==
                  first.instances.items[i].camera_from_part.matrix());
  }
}

TEST(KnownBinOfACell, IsWhereTheCameraSeesItWhateverTheFilesFrame) {
  const Pose base_from_camera = test::random_pose(900.0, 5u), input_from_camera = test::random_pose(300.0, 6u);
  WorkCell cell;
  cell.bin = CellBin{};
  cell.bin->inner_size_mm = kShape.inner_size_mm;
  cell.bin->base_from_bin = test::random_pose(100.0, 7u);
  cell.hand_eye = {base_from_camera * input_from_camera.inverse(), 0.4, 0.001};  // of the file's frame
  Scan scan;
  scan.input_from_camera = input_from_camera;
  const KnownBin known = known_bin(cell, scan);
  ASSERT_TRUE(known.camera_from_bin.has_value());
  EXPECT_TRUE(known.camera_from_bin->isApprox(base_from_camera.inverse() * cell.bin->base_from_bin, 1e-9));
  EXPECT_EQ(known.sigma_mm, 0.4);
  EXPECT_EQ(known.sigma_rad, 0.001);
  // Neither a place nor a camera's: it is sought.
  cell.hand_eye = {};
  cell.bin->base_from_bin = Pose::Identity();
  scan.input_from_camera = Pose::Identity();
  EXPECT_FALSE(known_bin(cell, scan).camera_from_bin.has_value());
}

}  // namespace
}  // namespace tribin
