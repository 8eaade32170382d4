// Pieces of one cylinder: joined where something hides the rest, apart where the scan sees between them.

#include <gtest/gtest.h>

#include <cmath>

#include "support/analytic_scan.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

using test::AnalyticSurface;

struct Rods {
  std::vector<const Primitive*> items;
  Primitives all;
};

/// Cylinders of about radius 25.
Rods rods(const std::vector<AnalyticSurface>& scene, unsigned seed) {
  Rods out;
  out.all = segment(surfels_from_scan(test::cast(scene, {.sigma_mm = 0.1, .correlation_px = 0.7}, seed)));
  for (const Primitive& p : out.all.items)
    if (p.type == PrimitiveType::cylinder && std::abs(p.radius_mm - 25) < 3) out.items.push_back(&p);
  return out;
}

TEST(Merge, HiddenMiddleIsOneCylinder) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Vec3 axis = Vec3(1, 0.1 * seed, 0.1).normalized();
    const AnalyticSurface rod{PrimitiveType::cylinder, {0, 0, 420}, axis, 25, 60};
    const AnalyticSurface bar{PrimitiveType::cylinder, {0, 0, 350}, Vec3(-0.1, 1, 0).normalized(), 12, 200};
    const AnalyticSurface floor{PrimitiveType::plane, {0, 0, 460}, -Vec3::UnitZ()};
    const Rods found = rods({rod, bar, floor}, seed);
    ASSERT_EQ(found.items.size(), 1u);
    const Primitive& p = *found.items[0];
    EXPECT_GT(p.height_mm(), 110);
    EXPECT_NEAR(p.radius_mm, 25, 4 * std::sqrt(p.covariance(4, 4)));
    const Vec3 q = p.point - rod.point;
    EXPECT_LT((q - axis * axis.dot(q)).norm(), 0.1);
  }
}

TEST(Merge, TwoRodsInLineStayTwo) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Vec3 axis = Vec3(1, 0.1 * seed, 0.1).normalized();
    const AnalyticSurface one{PrimitiveType::cylinder, Vec3(0, 0, 420) - 35 * axis, axis, 25, 25};
    const AnalyticSurface two{PrimitiveType::cylinder, Vec3(0, 0, 420) + 35 * axis, axis, 25, 25};
    const AnalyticSurface floor{PrimitiveType::plane, {0, 0, 460}, -Vec3::UnitZ()};
    EXPECT_EQ(rods({one, two, floor}, seed).items.size(), 2u);
  }
}

TEST(Merge, RadiiThatDifferByMoreThanTheyAreKnownStayTwo) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Vec3 axis = Vec3(1, 0.1 * seed, 0.1).normalized();
    const AnalyticSurface one{PrimitiveType::cylinder, Vec3(0, 0, 420) - 35 * axis, axis, 25, 25};
    const AnalyticSurface two{PrimitiveType::cylinder, Vec3(0, 0, 420) + 35 * axis, axis, 25.6, 25};
    const AnalyticSurface bar{PrimitiveType::cylinder, {0, 0, 350}, Vec3(-0.1, 1, 0).normalized(), 14, 200};
    EXPECT_EQ(rods({one, two, bar}, seed).items.size(), 2u);
  }
}

}  // namespace
}  // namespace tribin
