#include "tribin/surfel/pixel_normals.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/analytic_scan.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using test::AnalyticSurface;

double angle_deg(const Vec3f& a, const Vec3& b) {
  return std::atan2(a.cast<double>().cross(b).norm(), a.cast<double>().dot(b)) / kDegree;
}

/// rms angle of a plane's normals over what the bound says: sqrt(2) sqrt(12) sigma / (p N sqrt(N^2 - 1)).
double over_bound(NormalMethod method, int window) {
  constexpr double kSigma = 0.1;
  const AnalyticSurface wall{PrimitiveType::plane, {0, 0, 400}, -Vec3::UnitZ()};
  double squares = 0;
  std::size_t count = 0;
  double pitch = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Scan scan = test::cast({wall}, {.sigma_mm = kSigma}, seed);
    pitch = 400 / scan.camera.fx;
    const Image<Vec3f> normals = pixel_normals(scan, {.method = method, .window_px = window});
    for (int v = 20; v < scan.height() - 20; ++v)
      for (int u = 20; u < scan.width() - 20; ++u) {
        squares += std::pow(angle_deg(normals(u, v), wall.axis) * kDegree, 2);
        ++count;
      }
  }
  const double n = window, bound = std::sqrt(2.0) * std::sqrt(12.0) * kSigma / (pitch * n * std::sqrt(n * n - 1));
  return std::sqrt(squares / static_cast<double>(count)) / bound;
}

TEST(PixelNormals, AreAtTheBoundOnFlats) {
  for (int window : {5, 7, 9, 11, 13, 15}) {
    const double ratio = over_bound(NormalMethod::inverse_depth, window);
    std::printf("inverse_depth, window %2d: %.3f times the bound\n", window, ratio);
    EXPECT_NEAR(ratio, 1, 0.1) << window;
  }
}

TEST(PixelNormals, TangentMaskIsNearTheBoundOnFlats) {
  for (int window : {5, 7, 9, 11, 13, 15}) {
    const double ratio = over_bound(NormalMethod::tangent_mask, window);
    std::printf("tangent_mask, window %2d: %.3f times the bound\n", window, ratio);
    EXPECT_NEAR(ratio, 1, 0.2) << window;
  }
}

TEST(PixelNormals, AreUnbiasedOnRadiiOfTwoWindows) {
  // No noise to speak of: what is left is the windows' own error, up to 37 deg off the line of sight.
  for (int window : {7, 11, 15}) {
    const AnalyticSurface facing{PrimitiveType::plane, {0, 0, 400}, -Vec3::UnitZ()};
    const double pitch = 400 / test::cast({facing}, {.sigma_mm = 0.001}, 1).camera.fx;
    const double radius = 2 * window * pitch * 1.01;
    const AnalyticSurface rod{PrimitiveType::cylinder, {0, 0, 400}, Vec3(0.2, 1, 0.1).normalized(), radius};
    const Scan scan = test::cast({rod}, {.sigma_mm = 0.001}, 1);
    const Image<Vec3f> normals = pixel_normals(scan, {.window_px = window});
    double worst = 0, sum = 0;
    std::size_t count = 0;
    for (int v = 20; v < scan.height() - 20; ++v)
      for (int u = 0; u < scan.width(); ++u) {
        if (!std::isfinite(scan.z_mm(u, v))) continue;
        const Vec3 p = scan.point(u, v), q = p - rod.point;
        const Vec3 truth = (q - rod.axis * rod.axis.dot(q)).normalized();
        if (-truth.dot(p.normalized()) < 0.8) continue;  // within 37 deg; beyond, windows reach over the rim
        const double off = angle_deg(normals(u, v), truth);
        worst = std::max(worst, off);
        sum += off;
        ++count;
      }
    ASSERT_GT(count, 200u);
    std::printf("window %2d on a radius of two windows: mean %.3f deg, worst %.3f deg\n", window,
                sum / static_cast<double>(count), worst);
    EXPECT_LT(sum / static_cast<double>(count), 0.2) << window;
  }
}

TEST(PixelNormals, AreBoundedBesideEdges) {
  // A block before a wall: every pixel has a normal, and none is of the step between the two.
  const AnalyticSurface wall{PrimitiveType::plane, {0, 0, 400}, Vec3(0.1, 0, -1).normalized()};
  Scan scan = test::cast({wall}, {.sigma_mm = 0.05}, 3);
  for (int v = 40; v < 90; ++v)
    for (int u = 40; u < 100; ++u) scan.z_mm(u, v) -= 20;
  for (int v = 60; v < 64; ++v) scan.z_mm(50, v) = std::nanf("");
  const Image<Vec3f> normals = pixel_normals(scan, {.window_px = 7});
  double worst = 0;
  for (int v = 0; v < scan.height(); ++v)
    for (int u = 0; u < scan.width(); ++u) {
      if (!std::isfinite(scan.z_mm(u, v))) continue;
      ASSERT_NEAR(normals(u, v).norm(), 1, 1e-3) << u << ' ' << v;
      worst = std::max(worst, angle_deg(normals(u, v), wall.axis));
    }
  std::printf("beside edges: worst %.2f deg\n", worst);
  EXPECT_LT(worst, 15);  // five times the sd of the half window at its corner
}

TEST(PixelNormals, RefuseAnEvenWindow) {
  const AnalyticSurface wall{PrimitiveType::plane, {0, 0, 400}, -Vec3::UnitZ()};
  const Scan scan = test::cast({wall}, {.sigma_mm = 0.1}, 1);
  EXPECT_THROW(pixel_normals(scan, {.window_px = 8}), Error);
}

}  // namespace
}  // namespace tribin
