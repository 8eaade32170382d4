// Cylinders whose surfels bend too little, or are too few, for rulings: narrow bands, large radii under noise.

#include <gtest/gtest.h>

#include <cmath>

#include "segmentation/spaces.hpp"
#include "support/analytic_scan.hpp"

namespace tribin {
namespace {

using namespace segmentation_detail;
using test::AnalyticSurface;

Limits limits_for(const Scene& scene) {
  Limits limits;
  limits.min_area_mm2 = 30 * scene.cell_mm * scene.cell_mm;
  limits.min_surfels = 15;
  limits.max_radius_mm = 250;
  return limits;
}

int right_ones(const std::vector<FoundSurface>& found, const AnalyticSurface& truth) {
  int count = 0;
  for (const FoundSurface& f : found) {
    const Surface& s = f.fit.surface;
    count += s.type == PrimitiveType::cylinder && std::abs(s.axis.dot(truth.axis)) > std::cos(3 * kDegree) &&
             std::abs(s.radius - truth.radius) < 0.05 * truth.radius;
  }
  return count;
}

struct Case {
  const char* name;
  double radius, half_length, sigma_mm;
};

TEST(GreatCircles, FindWhatRulingsMiss) {
  for (const Case& c : {Case{"a band of 9 px", 60, 4, 0.15}, Case{"a band of 7 px", 60, 3, 0.1},
                        Case{"a band under noise", 60, 4, 0.4}, Case{"a short peg", 30, 4, 0.3}}) {
    SCOPED_TRACE(c.name);
    int by_rulings = 0, by_both = 0, false_ones = 0;
    constexpr int kSeeds = 10;
    for (unsigned seed = 1; seed <= kSeeds; ++seed) {
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> uniform(-1, 1);
      const Vec3 axis = Vec3(1, 0.5 * uniform(random), 0.3 * uniform(random)).normalized();
      const AnalyticSurface truth{PrimitiveType::cylinder,
                                  {5 * uniform(random), 5 * uniform(random), 350 + c.radius},
                                  axis,
                                  c.radius,
                                  c.half_length};
      const Scan scan = test::cast({truth}, {.sigma_mm = c.sigma_mm}, seed);
      const Surfels surfels = surfels_from_scan(scan);
      Scene scene(surfels);
      const Limits limits = limits_for(scene);
      HoughSpaces spaces;
      std::vector<FoundSurface> found;
      find_cylinders(scene, limits, spaces, found);
      by_rulings += right_ones(found, truth);
      find_by_great_circles(scene, limits, spaces, found);
      by_both += right_ones(found, truth);
      false_ones += static_cast<int>(found.size()) - right_ones(found, truth);
    }
    EXPECT_EQ(by_rulings, 0);  // else the case shows nothing
    EXPECT_EQ(by_both, kSeeds);
    EXPECT_EQ(false_ones, 0);
  }
}

TEST(GreatCircles, LargeRadiusIsOnePieceAfterMerging) {
  int one = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const AnalyticSurface truth{PrimitiveType::cylinder, {0, 0, 510}, Vec3(1, 0.2, 0.1).normalized(), 160, 10};
    const Scan scan = test::cast({truth}, {.sigma_mm = 1.0}, seed);
    const Primitives found = segment(surfels_from_scan(scan));
    ASSERT_FALSE(found.items.empty());
    one += found.items.size() == 1;
    EXPECT_EQ(found.items[0].type, PrimitiveType::cylinder);
    EXPECT_NEAR(found.items[0].radius_mm, 160, 4 * std::sqrt(found.items[0].covariance(4, 4)));
  }
  EXPECT_GE(one, 9);  // a piece of 21 deg on its own holds its axis to 3 deg only
}

TEST(GreatCircles, TwoPlanesOrASphereAreNoCylinder) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    // A roof of two planes 10 to 50 deg apart, whose normals draw a great circle with two points on it.
    const double half = (15 + 10 * uniform(random)) * kDegree;
    const AnalyticSurface left{PrimitiveType::plane, {0, 0, 400}, Vec3(std::sin(half), 0, -std::cos(half))};
    const AnalyticSurface right{PrimitiveType::plane, {0, 0, 400}, Vec3(-std::sin(half), 0, -std::cos(half))};
    const AnalyticSurface ball{PrimitiveType::sphere, {40, 30, 370}, Vec3::UnitZ(), 15 + 5 * uniform(random)};
    for (double sigma : {0.1, 0.4}) {
      const Scan scan = test::cast({left, right, ball}, {.sigma_mm = sigma, .correlation_px = 0.7}, seed);
      for (const Primitive& p : segment(surfels_from_scan(scan)).items) EXPECT_NE(p.type, PrimitiveType::cylinder);
    }
  }
}

}  // namespace
}  // namespace tribin
