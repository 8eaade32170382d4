#include "tribin/capture/touch.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "sim/random.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

struct Off {
  Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();
  double scale = 1;
};

/// Ten places over a workspace of 600 x 400 x 200 mm, touched with the noise.
std::vector<TouchedPoint> touched_points(unsigned seed, double sigma_mm, const Off& off = {}) {
  sim::Random random(seed);
  std::vector<TouchedPoint> out;
  for (int i = 0; i < 10; ++i) {
    const Vec3 p(random.uniform(500, 1100), random.uniform(-200, 200), random.uniform(0, 200));
    const Vec3 noise(random.normal(), random.normal(), random.normal());
    const Vec3 q = Vec3(800, 0, 100) + off.scale * (rotation_from_vector(off.turn) * (p - Vec3(800, 0, 100)));
    out.push_back({std::to_string(i), p, Vec3(q + off.shift + sigma_mm * noise)});
  }
  return out;
}

TEST(Touch, FindsTheRigidPartAndWhatIsLeft) {
  double left = 0;
  constexpr unsigned kSeeds = 200;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Off off{.shift = {1.5, -0.8, 0.4}, .turn = {0.002, -0.001, 0.003}};
    const TouchResult found = evaluate_touch(touched_points(seed, 0.2, off));
    EXPECT_TRUE(found.rigid_error);
    EXPECT_FALSE(found.scale_error);
    EXPECT_NEAR(found.rotation_rad, off.turn.norm(), 0.003);  // 0.2 mm over lever arms of 100 to 300 mm
    EXPECT_LT((found.touched_from_predicted * Vec3(800, 0, 100) - Vec3(800, 0, 100) - off.shift).norm(), 0.5);
    EXPECT_GE(found.rms_mm, found.residual_rms_mm);
    left += found.residual_sigma_mm * found.residual_sigma_mm / kSeeds;
  }
  EXPECT_NEAR(std::sqrt(left), 0.2, 0.01);
}

TEST(Touch, GoodCalibrationsAreNotAccused) {
  int rigid = 0, scale = 0;
  for (unsigned seed = 1; seed <= 2000; ++seed) {
    const TouchResult found = evaluate_touch(touched_points(seed, 0.2));
    rigid += found.rigid_error;
    scale += found.scale_error;
  }
  EXPECT_LE(rigid, 8);  // 2 are wanted of a test at 0.1 %
  EXPECT_LE(scale, 8);
}

TEST(Touch, AWrongScaleIsToldFromAWrongPose) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    const TouchResult found = evaluate_touch(touched_points(seed, 0.1, {.scale = 1.004}));
    EXPECT_TRUE(found.scale_error);
    EXPECT_NEAR(found.scale, 1.004, 5 * found.scale_sigma);
  }
}

TEST(Touch, RegionsHoldEachPointOnce) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<TouchedPoint> points = touched_points(seed, 0.3, {.scale = 1.01});
    const TouchResult found = evaluate_touch(points);
    std::vector<int> seen;
    double sum = 0;
    for (const TouchRegion& region : found.regions) {
      seen.insert(seen.end(), region.points.begin(), region.points.end());
      sum += region.rms_mm * region.rms_mm * static_cast<double>(region.points.size());
      for (int i : region.points)
        EXPECT_TRUE(((points[i].touched_mm - region.min_mm).array() >= 0).all() &&
                    ((region.max_mm - points[i].touched_mm).array() >= 0).all());
    }
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(seen, (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
    EXPECT_NEAR(std::sqrt(sum / 10), found.rms_mm, 1e-9);
  }
}

TEST(Touch, TooFewPointsOrALineAreErrors) {
  std::vector<TouchedPoint> points = touched_points(1, 0.1);
  EXPECT_THROW(evaluate_touch(std::span(points).first(2)), Error);
  EXPECT_NO_THROW(evaluate_touch(std::span(points).first(3)));
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].predicted_mm = points[i].touched_mm = Vec3(500 + 20.0 * static_cast<double>(i), 0, 0);
  try {
    evaluate_touch(points);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::too_little_data);
  }
}

}  // namespace
}  // namespace tribin
