#include "io/lattice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tribin::io {
namespace {

/// What a camera of focal length f sees, in pixels that need not be square, a fifth of them lost.
RawCloud loose_cloud(double fx, double fy, unsigned seed, double jitter_px = 0) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double cx = 40 + 60 * uniform(random), cy = 30 + 40 * uniform(random), sign = seed % 2 ? 1 : -1;
  RawCloud out;
  out.name = "cloud.ply";
  for (int v = 0; v < 100; ++v)
    for (int u = 0; u < 130; ++u) {
      if (uniform(random) < 0.2) continue;
      const double z = 600 + 50 * std::sin(0.05 * u) + 30 * std::cos(0.08 * v);
      const double du = jitter_px * (uniform(random) - 0.5), dv = jitter_px * (uniform(random) - 0.5);
      out.points.emplace_back(float((u + du - cx) / fx * z), float((v + dv - cy) / fy * z), float(sign * z));
    }
  out.width = static_cast<int>(out.points.size());
  std::shuffle(out.points.begin(), out.points.end(), random);  // whatever order a program wrote them in
  return out;
}

TEST(RegainGrid, FindsThePixelsOfAnyCamera) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    const double fx = 200 + 60 * seed, fy = fx * (seed % 3 ? 1 : 1.04);
    const RawCloud loose = loose_cloud(fx, fy, seed);
    const auto grid = regain_grid(loose);
    ASSERT_TRUE(grid.has_value());
    EXPECT_EQ(grid->width, 130);
    EXPECT_EQ(grid->height, 100);
    std::size_t kept = 0;
    for (const Vec3f& p : grid->points) kept += p.allFinite();
    EXPECT_EQ(kept, loose.points.size());
  }
}

TEST(RegainGrid, PointsOfNoGridStayLoose) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    EXPECT_FALSE(regain_grid(loose_cloud(400, 400, seed, 1)).has_value());
  }
}

}  // namespace
}  // namespace tribin::io
