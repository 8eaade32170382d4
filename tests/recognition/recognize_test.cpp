#include <gtest/gtest.h>

#include "support/posed_scan.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin {
namespace {

const Part& alternator(char which) {
  const auto read = [](char name) {
    return compile_part(read_cad(std::string(TRIBIN_SOURCE_DIR) + "/examples/parts/alternator_" + name + ".stl", {}));
  };
  static const Part a = read('a'), b = read('b');
  return which == 'a' ? a : b;
}

/// The part floats over the table: no rest is needed for the geometry to be true.
Scan scan_of(const Part& part, const Pose& truth, unsigned seed) {
  return test::posed_scan({{&part.mesh, truth}}, Vec3(0, 0, -1), -950, 0.1, 0.8, seed, 800, 640);
}

TEST(FindParts, TellsTheAlternatorsApartAndWhereTheyAre) {
  const std::vector<Part> parts = {alternator('a'), alternator('b')};
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Part& part = parts[seed % 2];
    Pose truth = test::random_pose(700, seed);
    const Scan scan = scan_of(part, truth, seed);
    const Found found = find_parts(scan, parts);
    ASSERT_EQ(found.instances.items.size(), 1u);
    const Instance& instance = found.instances.items[0];
    EXPECT_EQ(instance.part, part.name);
    EXPECT_EQ(found.status, "ok");
    const Eigen::Vector3d c = part.box_center();
    EXPECT_LT((instance.camera_from_part * c - truth * c).norm(), 0.1);
    EXPECT_LT(rotation_angle(instance.camera_from_part.linear(), truth.linear()), 0.1 * kDegree);
    EXPECT_GT(instance.score, 0.9);
    EXPECT_FALSE(instance.evidence.empty());
  }
}

TEST(FindParts, FindsPartsWhereTheSensorDrawsStepsOut) {
  const std::vector<Part> parts = {alternator('a'), alternator('b')};
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Part& part = parts[seed % 2];
    const Pose truth = test::random_pose(500, seed);
    Scan scan = test::posed_scan({{&part.mesh, truth}}, Vec3(0, 0, -1), -620, 0, 0, seed, 400, 320);
    test::draw_steps_out(scan.z_mm, 2.5);
    const std::vector<double> noise = test::correlated_noise(scan.width(), scan.height(), 0.6, seed);
    for (std::size_t i = 0; i < scan.z_mm.size(); ++i) scan.z_mm.data[i] += static_cast<float>(0.3 * noise[i]);
    const Found found = find_parts(scan, parts);
    ASSERT_EQ(found.instances.items.size(), 1u);
    const Instance& instance = found.instances.items[0];
    EXPECT_EQ(instance.part, part.name);
    const Eigen::Vector3d c = part.box_center();
    EXPECT_LT((instance.camera_from_part * c - truth * c).norm(), 1);  // a pixel is 0.9 mm, the blur 2.5
    EXPECT_LT(rotation_angle(instance.camera_from_part.linear(), truth.linear()), 2 * kDegree);
    EXPECT_GT(instance.score, 0.9);
  }
}

TEST(FindParts, AnEmptyTableHasNoPartsAndReasons) {
  const std::vector<Part> parts = {alternator('a')};
  const Scan scan = test::posed_scan({}, Vec3(0, 0, -1), -800, 0.1, 0.8, 1, 800, 640);
  const Found found = find_parts(scan, parts);
  EXPECT_TRUE(found.instances.items.empty());
  EXPECT_EQ(found.status, "empty");
}

TEST(FindParts, AForeignBodyIsNoAlternator) {
  const std::vector<Part> parts = {alternator('a')};
  const Part& other = alternator('b');
  const Found found = find_parts(scan_of(other, test::random_pose(700, 11), 11), parts);
  for (const Instance& i : found.instances.items) {
    // A look-alike may pass only where what tells it apart is not in view; then it must say that it is not sure.
    EXPECT_LT(i.score, 0.9);
  }
}

TEST(FindParts, GivesTheSameBytesOnAnyNumberOfThreads) {
  const std::vector<Part> parts = {alternator('a')};
  const Scan scan = scan_of(parts[0], test::random_pose(700, 4), 4);
  set_thread_count(1);
  const Found one = find_parts(scan, parts);
  set_thread_count(2);
  const Found two = find_parts(scan, parts);
  set_thread_count(0);
  ASSERT_EQ(one.instances.items.size(), two.instances.items.size());
  for (std::size_t i = 0; i < one.instances.items.size(); ++i) {
    EXPECT_TRUE(one.instances.items[i].camera_from_part.matrix() == two.instances.items[i].camera_from_part.matrix());
    EXPECT_TRUE(one.instances.items[i].covariance == two.instances.items[i].covariance);
    EXPECT_EQ(one.instances.items[i].score, two.instances.items[i].score);
  }
}

}  // namespace
}  // namespace tribin
