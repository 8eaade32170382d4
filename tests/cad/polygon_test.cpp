#include "tribin/cad/polygon.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tribin {
namespace {

TEST(TriangulatePolygon, CoversAnyStarOnceInAnyPlane) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> radius(1, 10), side(-1, 1);
    const int n = 3 + static_cast<int>(random() % 30);
    const Vec3 axis = Vec3(side(random), side(random), side(random)).normalized();
    Vec3 u, v;
    orthonormal_basis(axis, u, v);
    std::vector<Vec3> corners;
    for (int i = 0; i < n; ++i) {
      const double r = radius(random), angle = 2 * kPi * i / n;
      corners.push_back(Vec3(100, 0, 0) + r * std::cos(angle) * u + r * std::sin(angle) * v);
    }
    double truth = 0;
    for (int i = 0; i < n; ++i) {
      const Vec3 a = corners[i] - Vec3(100, 0, 0), b = corners[(i + 1) % n] - Vec3(100, 0, 0);
      truth += 0.5 * axis.dot(a.cross(b));
    }
    const auto triangles = triangulate_polygon(corners);
    ASSERT_EQ(triangles.size(), static_cast<std::size_t>(n - 2));
    double sum = 0;
    for (const auto& t : triangles) {
      const Vec3 ab = corners[t[1]] - corners[t[0]], ac = corners[t[2]] - corners[t[0]];
      const double area = 0.5 * axis.dot(ab.cross(ac));
      EXPECT_GT(area, -1e-9);
      sum += area;
    }
    EXPECT_NEAR(sum, truth, 1e-9 * truth);
  }
}

}  // namespace
}  // namespace tribin
