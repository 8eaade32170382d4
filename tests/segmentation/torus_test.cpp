// Bends of pipes and fillets come out as tori, and balls stay balls.

#include <gtest/gtest.h>

#include <cmath>

#include "support/analytic_scan.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

/// Depth at which a ray with z = 1 meets a torus, by sphere tracing from `near`; infinite where it misses.
double meet_torus(const Vec3& center, const Vec3& axis, double radius, double minor, const Vec3& ray, double near) {
  const double length = ray.norm();
  double z = near;
  for (int step = 0; step < 300; ++step) {
    const Vec3 q = ray * z - center;
    const double t = axis.dot(q), d = std::hypot((q - axis * t).norm() - radius, t) - minor;
    if (d < 1e-7) return z;
    z += d / length;
    if (z > near + 400) break;
  }
  return std::numeric_limits<double>::infinity();
}

TEST(Torus, RingIsFoundWithBothRadii) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const double radius = 40 + 10 * unit(random), minor = 10 + 6 * unit(random);
    const Vec3 center(5 * unit(random), -5 * unit(random), 400);
    const Vec3 axis = Vec3(0.6 * unit(random), 0.6 * unit(random), 1).normalized();
    const test::ScanOptions options{.width = 320, .height = 256, .focal_px = 600, .sigma_mm = 0.1};
    const test::AnalyticSurface floor{PrimitiveType::plane, {0, 0, 470}, -Vec3::UnitZ()};
    Scan scan = test::cast({floor}, options, seed);
    for (int v = 0; v < options.height; ++v)
      for (int u = 0; u < options.width; ++u) {
        const double z = meet_torus(center, axis, radius, minor, scan.camera.ray(u, v), 300);
        if (z < 470) scan.z_mm(u, v) += static_cast<float>(z - 470);
      }
    const Primitives found = segment(surfels_from_scan(scan));
    ASSERT_GE(found.items.size(), 2u);
    const Primitive* torus = nullptr;
    for (const Primitive& p : found.items)
      if (p.type == PrimitiveType::torus && (!torus || p.points > torus->points)) torus = &p;
    ASSERT_NE(torus, nullptr);
    EXPECT_NEAR(torus->radius_mm, radius, 0.5);
    EXPECT_NEAR(torus->minor_radius_mm, minor, 0.3);
    EXPECT_LT((torus->point - center).norm(), 0.5);
    EXPECT_GT(std::abs(torus->axis.dot(axis)), std::cos(1 * kDegree));
    EXPECT_FALSE(torus->concave);
  }
}

}  // namespace
}  // namespace tribin
