#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "support/analytic_scan.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

using test::AnalyticSurface;

int count_of(const Primitives& primitives, PrimitiveType type) {
  return static_cast<int>(std::count_if(primitives.items.begin(), primitives.items.end(),
                                        [&](const Primitive& p) { return p.type == type; }));
}

const Primitive* nearest_radius(const Primitives& primitives, double radius) {
  const Primitive* best = nullptr;
  for (const Primitive& p : primitives.items)
    if (p.type == PrimitiveType::cylinder &&
        (best == nullptr || std::abs(p.radius_mm - radius) < std::abs(best->radius_mm - radius)))
      best = &p;
  return best;
}

TEST(Segment, CylinderWithinItsCovariance) {
  int inside_radius = 0, trials = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const AnalyticSurface truth{PrimitiveType::cylinder,
                                {20 * uniform(random), 15 * uniform(random), 380 + 20 * uniform(random)},
                                Vec3(1, uniform(random), 0.3 * uniform(random)).normalized(),
                                15 + 10 * (uniform(random) + 1),
                                50};
    const AnalyticSurface floor{PrimitiveType::plane, {0, 0, 460}, -Vec3::UnitZ()};
    const Scan scan = test::cast({truth, floor}, {.sigma_mm = 0.1, .correlation_px = seed % 2 ? 0.0 : 0.8}, seed);
    const Primitives found = segment(surfels_from_scan(scan));
    ASSERT_EQ(count_of(found, PrimitiveType::cylinder), 1);
    ASSERT_EQ(count_of(found, PrimitiveType::plane), 1);
    const Primitive& c = *nearest_radius(found, truth.radius);
    EXPECT_LT(std::acos(std::min(1.0, std::abs(c.axis.dot(truth.axis)))), 0.3 * kDegree);
    const Vec3 q = c.point - truth.point;
    EXPECT_LT((q - truth.axis * truth.axis.dot(q)).norm(), 0.25);
    EXPECT_FALSE(c.concave);
    inside_radius += std::abs(c.radius_mm - truth.radius) < 3.0 * std::sqrt(c.covariance(4, 4));
    ++trials;
  }
  EXPECT_GE(inside_radius, trials - 3);
}

TEST(Segment, LargeCylindersAreNotCutIntoPlanes) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const AnalyticSurface truth{PrimitiveType::cylinder, {0, 0, 420}, Vec3(1, 0.2, 0.1).normalized(), 65, 60};
    const Scan scan = test::cast({truth}, {.sigma_mm = 0.3}, seed);
    const Primitives found = segment(surfels_from_scan(scan), {.radii_mm = {65}});
    EXPECT_EQ(count_of(found, PrimitiveType::plane), 0);
    EXPECT_EQ(count_of(found, PrimitiveType::cylinder), 1);
  }
}

TEST(Segment, CoaxialStepsStayApart) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Vec3 axis = Vec3(1, 0.1, 0).normalized();
    const AnalyticSurface thin{PrimitiveType::cylinder, Vec3(0, 0, 420) - 25 * axis, axis, 60, 25};
    const AnalyticSurface wide{PrimitiveType::cylinder, Vec3(0, 0, 420) + 25 * axis, axis, 63, 25};
    const Scan scan = test::cast({thin, wide}, {.width = 640, .height = 512, .focal_px = 900, .sigma_mm = 0.1}, seed);
    const Primitives found = segment(surfels_from_scan(scan), {.radii_mm = {60, 63}});
    ASSERT_EQ(count_of(found, PrimitiveType::cylinder), 2);
    EXPECT_NEAR(nearest_radius(found, 60)->radius_mm, 60, 0.15);
    EXPECT_NEAR(nearest_radius(found, 63)->radius_mm, 63, 0.15);
  }
}

TEST(Segment, MovingTheCameraMovesTheAnswer) {
  // The same body turned about the optical axis by 90 deg: the picture turns pixel for pixel.
  const AnalyticSurface one{PrimitiveType::cylinder, {8, 3, 380}, Vec3(1, 0.2, 0.1).normalized(), 25, 40};
  const AnalyticSurface two{PrimitiveType::cylinder, {-3, 8, 380}, Vec3(-0.2, 1, 0.1).normalized(), 25, 40};
  const test::ScanOptions options{.width = 256, .height = 256, .sigma_mm = 0.001};
  const Primitives a = segment(surfels_from_scan(test::cast({one}, options, 1)));
  const Primitives b = segment(surfels_from_scan(test::cast({two}, options, 1)));
  ASSERT_EQ(count_of(a, PrimitiveType::cylinder), 1);
  ASSERT_EQ(count_of(b, PrimitiveType::cylinder), 1);
  EXPECT_NEAR(a.items[0].radius_mm, b.items[0].radius_mm, 0.01);
  const Vec3 turned(-a.items[0].point.y(), a.items[0].point.x(), a.items[0].point.z());
  const Vec3 q = turned - b.items[0].point;
  EXPECT_LT((q - two.axis * two.axis.dot(q)).norm(), 0.02);
}

TEST(Segment, SameBytesForAnyThreadCount) {
  const AnalyticSurface floor{PrimitiveType::plane, {0, 0, 460}, -Vec3::UnitZ()};
  const AnalyticSurface rod{PrimitiveType::cylinder, {0, 0, 400}, Vec3(1, 0.4, 0).normalized(), 20, 50};
  const Scan scan = test::cast({floor, rod}, {}, 5);
  std::vector<Primitives> results;
  for (int threads : {1, 2}) {
    set_thread_count(threads);
    results.push_back(segment(surfels_from_scan(scan)));
  }
  set_thread_count(0);
  ASSERT_EQ(results[0].items.size(), results[1].items.size());
  EXPECT_EQ(results[0].label_of_surfel, results[1].label_of_surfel);
  for (std::size_t i = 0; i < results[0].items.size(); ++i) {
    EXPECT_EQ(results[0].items[i].axis, results[1].items[i].axis);
    EXPECT_EQ(results[0].items[i].radius_mm, results[1].items[i].radius_mm);
  }
}

TEST(GoldenSpiral, CoversTheHalfSphereEvenly) {
  const std::vector<Vec3f> centers = golden_spiral(2048);
  for (const Vec3f& c : centers) {
    EXPECT_NEAR(c.norm(), 1, 1e-6);
    EXPECT_GT(c.z(), 0);
  }
}

}  // namespace
}  // namespace tribin
