#include "recognition/point_pairs.hpp"

#include <gtest/gtest.h>

#include "support/posed_scan.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin {
namespace {

const Part& alternator() {
  static const Part part =
      compile_part(read_cad(std::string(TRIBIN_SOURCE_DIR) + "/examples/parts/alternator_b.stl", {}));
  return part;
}

TEST(PointPairs, AreTheSameWhateverThePose) {
  const Part& part = alternator();
  const PointPairSteps steps(part.diameter_mm);
  int same = 0, all = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Pose pose = test::random_pose(700, seed);
    for (std::size_t a = 0; a + 7 < part.sample_points.size(); a += 5) {
      const std::size_t b = a + 7;
      Vec3 ud, vd;
      orthonormal_basis(part.sample_normals[a].cast<double>(), ud, vd);
      const auto moved = [&](std::size_t i) {
        return Vec3f((pose * part.sample_points[i].cast<double>()).cast<float>());
      };
      const auto turned = [&](const Vec3f& n) { return Vec3f((pose.linear() * n.cast<double>()).cast<float>()); };
      const auto here = steps.pair(part.sample_points[a], part.sample_normals[a], ud.cast<float>(), vd.cast<float>(),
                                   part.sample_points[b], part.sample_normals[b]);
      const auto there = steps.pair(moved(a), turned(part.sample_normals[a]), turned(ud.cast<float>()),
                                    turned(vd.cast<float>()), moved(b), turned(part.sample_normals[b]));
      ASSERT_EQ(here.has_value(), there.has_value());
      if (!here) continue;
      ++all;
      same += here->key == there->key && std::abs(std::remainder(here->turn - there->turn, 2 * kPi)) < 1e-2;
    }
  }
  EXPECT_GT(all, 100);
  EXPECT_GT(same, 0.97 * all);  // a step's border that rounding crosses
}

TEST(PointPairs, AreAllInTheTable) {
  const Part& part = alternator();
  const PointPairTable table(part.sample_points, part.sample_normals, part.diameter_mm);
  std::size_t entries = 0;
  for (std::uint32_t key = 0; key < table.steps().keys(); ++key) entries += table.with(key).size();
  const std::size_t n = part.sample_points.size();
  EXPECT_LE(entries, n * (n - 1));
  EXPECT_GT(entries, n * (n - 1) * 9 / 10);  // all but those closer than half a step
}

}  // namespace
}  // namespace tribin
