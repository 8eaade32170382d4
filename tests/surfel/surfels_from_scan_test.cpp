#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "support/analytic_scan.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {
namespace {

using test::AnalyticSurface;

const AnalyticSurface kTilted{PrimitiveType::plane, {0, 0, 400}, Vec3(0.3, -0.2, -1).normalized()};

TEST(EstimateNoise, FindsSigmaAndCorrelation) {
  for (double c : {0.0, 0.5, 0.8, 1.2})
    for (unsigned seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(testing::Message() << "c " << c << " seed " << seed);
      const Scan scan = test::cast({kTilted}, {.sigma_mm = 0.1, .correlation_px = c}, seed);
      const NoiseProfile noise = estimate_noise(scan);
      EXPECT_NEAR(noise.sigma_mm, 0.1, 0.015);
      // Below 0.35 px the third differences are blind; beyond 1 px a small scan holds few independent samples.
      EXPECT_NEAR(noise.correlation_px, c, c < 0.35 ? 0.36 : c < 1 ? 0.15 : 0.25);
    }
}

TEST(EstimateNoise, QuantisedDepthsKeepASigma) {
  const Scan scan = test::cast({kTilted}, {.sigma_mm = 0.05, .quantum_mm = 1.0}, 1);
  const Surfels surfels = surfels_from_scan(scan);
  for (float sigma : surfels.local_sigma_mm.data) EXPECT_GT(sigma, 0.28f);  // 1 / sqrt(12)
}

TEST(SurfelsFromScan, NormalsOfAPlaneAreWithinTheirSigma) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Scan scan = test::cast({kTilted}, {.sigma_mm = 0.1}, seed);
    const Surfels s = surfels_from_scan(scan);
    double squares = 0;
    for (std::size_t i = 0; i < s.size(); ++i) {
      const double sine = s.normal[i].cast<double>().cross(kTilted.axis).norm();
      squares += sine * sine / (2.0 * s.sigma_normal[i] * s.sigma_normal[i]);
      EXPECT_LT(s.normal[i].z(), 0);
    }
    const double ratio = std::sqrt(squares / static_cast<double>(s.size()));
    EXPECT_GT(ratio, 0.6);
    EXPECT_LT(ratio, 1.3);
    const auto flat = std::count(s.shape.begin(), s.shape.end(), SurfelShape::flat);
    EXPECT_EQ(std::count(s.shape.begin(), s.shape.end(), SurfelShape::curved) * 100 / std::max<long>(1, flat), 0);
  }
}

TEST(SurfelsFromScan, CurvatureOfACylinder) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const AnalyticSurface cylinder{PrimitiveType::cylinder, {5, -3, 320}, Vec3(1, 0.3, 0.2).normalized(), 30};
    const Scan scan = test::cast({cylinder}, {.sigma_mm = 0.05}, seed);
    const Surfels s = surfels_from_scan(scan);
    std::vector<double> ratio, tilt;
    for (std::size_t i = 0; i < s.size(); ++i) {
      if (s.shape[i] != SurfelShape::ruled) continue;
      ratio.push_back(s.curvature1[i] * 30.0);
      tilt.push_back(std::acos(std::min(1.0, std::abs(s.direction2[i].cast<double>().dot(cylinder.axis)))));
    }
    ASSERT_GT(ratio.size(), 200u);
    std::nth_element(ratio.begin(), ratio.begin() + ratio.size() / 2, ratio.end());
    std::nth_element(tilt.begin(), tilt.begin() + tilt.size() / 2, tilt.end());
    EXPECT_NEAR(ratio[ratio.size() / 2], 1.0, 0.05);
    EXPECT_LT(tilt[tilt.size() / 2], 3 * kDegree);
  }
}

TEST(SurfelsFromScan, SameBytesForAnyThreadCount) {
  const Scan scan = test::cast({kTilted, {PrimitiveType::cylinder, {0, 0, 330}, Vec3::UnitX(), 30}}, {}, 3);
  set_thread_count(1);
  const Surfels one = surfels_from_scan(scan);
  set_thread_count(2);
  const Surfels two = surfels_from_scan(scan);
  set_thread_count(0);
  ASSERT_EQ(one.size(), two.size());
  EXPECT_EQ(std::memcmp(one.position.data(), two.position.data(), one.size() * sizeof(Vec3f)), 0);
  EXPECT_EQ(std::memcmp(one.normal.data(), two.normal.data(), one.size() * sizeof(Vec3f)), 0);
  EXPECT_EQ(one.neighbours, two.neighbours);
}

TEST(SurfelsFromScan, SaysWhatIsMissing) {
  Scan scan = test::cast({}, {}, 1);
  EXPECT_THROW(surfels_from_scan(scan), Error);
}

}  // namespace
}  // namespace tribin
