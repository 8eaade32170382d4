#include "tribin/sim/structured_light.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/sim/table_scene.hpp"

namespace tribin::sim {
namespace {

/// A closed box with its corner at the origin.
Mesh box_mesh(float x, float y, float z) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.push_back({i & 1 ? x : 0, i & 2 ? y : 0, i & 4 ? z : 0});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  mesh.name = "box";
  return mesh;
}

StructuredLight small_sensor() {
  StructuredLight sensor;
  sensor.camera = {320, 256, 400, 400, 159.5, 127.5};
  sensor.reference_mm = 800;
  sensor.noise_mm = 0.1;
  sensor.systematic = 0;
  return sensor;
}

TEST(SimulateScan, NoiseHasTheAskedSizeAndCorrelation) {
  const Mesh table = table_mesh();
  for (const double c : {0.0, 0.5, 1.0, 2.0}) {
    StructuredLight sensor = small_sensor();
    sensor.noise_correlation_px = c;
    const SimulatedScan s = simulate_scan({{&table, camera_above(800, 0, 0), 0.5, 0}}, sensor, 7);
    double sum = 0, squares = 0, neighbours = 0;
    int n = 0;
    for (int v = 0; v < 256; ++v)
      for (int u = 0; u + 1 < 320; ++u) {
        const double a = (s.scan.z_mm(u, v) - s.true_z(u, v)) / s.sigma_mm(u, v);
        const double b = (s.scan.z_mm(u + 1, v) - s.true_z(u + 1, v)) / s.sigma_mm(u + 1, v);
        ASSERT_TRUE(std::isfinite(a));
        sum += a, squares += a * a, neighbours += a * b, ++n;
      }
    SCOPED_TRACE(c);
    EXPECT_NEAR(std::sqrt(squares / n), 1, 0.05);
    // The kernel's autocorrelation at one pixel: exp(-1 / (4 c^2)) for c >= 1, less where sampling cuts it.
    double same = 0, shifted = 0;
    for (int i = -20; i <= 20; ++i) {
      const auto weight = [&](int k) { return c > 0 ? std::exp(-0.5 * k * k / (c * c)) : k == 0 ? 1.0 : 0.0; };
      same += weight(i) * weight(i), shifted += weight(i) * weight(i + 1);
    }
    EXPECT_NEAR(neighbours / squares, shifted / same, 0.03);
    EXPECT_NEAR(s.sigma_mm(160, 128), 0.1, 0.001) << "a facing surface at the reference distance";
  }
}

TEST(SimulateScan, WithoutNoiseItIsTheTruth) {
  const Mesh table = table_mesh(), box = box_mesh(60, 40, 30);
  StructuredLight sensor = small_sensor();
  sensor.noise_mm = 1e-9;
  sensor.mixed_pixels = false;
  sensor.highlight = 0;
  const Pose view = camera_above(800, 0.2, 1);
  const SimulatedScan s = simulate_scan({{&table, view, 0.5, 0}, {&box, view, 0.5, 0}}, sensor, 1);
  int on_box = 0;
  for (int v = 0; v < 256; ++v)
    for (int u = 0; u < 320; ++u) {
      if (!std::isfinite(s.scan.z_mm(u, v))) continue;
      EXPECT_NEAR(s.scan.z_mm(u, v), s.true_z(u, v), 1e-3);
      if (s.body(u, v) != 1) continue;
      ++on_box;
      const Vec3 p = view.inverse() * s.scan.point(u, v);  // on the box's boundary
      EXPECT_LT(std::min({std::abs(p.z() - 30), std::abs(p.x()), std::abs(p.x() - 60), std::abs(p.y()),
                          std::abs(p.y() - 40)}),
                1e-3);
    }
  EXPECT_GT(on_box, 300);
  EXPECT_EQ(s.bodies[1].pixels_visible, s.bodies[1].pixels_all);
}

TEST(SimulateScan, TheProjectorsShadowLiesOnTheFarSide) {
  const Mesh table = table_mesh(), box = box_mesh(60, 40, 50);
  const Pose view = camera_above(800, 0, 0);
  const SimulatedScan s = simulate_scan({{&table, view, 0.5, 0}, {&box, view, 0.5, 0}}, small_sensor(), 1);
  // The projector stands at +x: the shadow falls left of the box, about 50 mm * 180 / 750 wide.
  int left = 0, right = 0;
  for (int v = 0; v < 256; ++v)
    for (int u = 0; u < 320; ++u)
      if (s.scan.invalid_reason(u, v) == static_cast<int>(Invalid::shadow) && s.body(u, v) == 0)
        (s.scan.camera.ray(u, v).x() * s.true_z(u, v) < 30 ? left : right) += 1;
  EXPECT_GT(left, 50);
  EXPECT_EQ(right, 0);
}

TEST(SimulateScan, TheSameBytesForAnyNumberOfThreads) {
  const Mesh table = table_mesh(), box = box_mesh(60, 40, 50);
  const Pose view = camera_above(800, 0.1, 2);
  const auto run = [&](int threads, std::uint64_t seed) {
    set_thread_count(threads);
    return simulate_scan({{&table, view, 0.5, 0}, {&box, view, 0.5, 1}}, small_sensor(), seed).scan.z_mm.data;
  };
  const auto one = run(1, 5), two = run(2, 5), other = run(2, 6);
  set_thread_count(0);
  EXPECT_EQ(std::memcmp(one.data(), two.data(), one.size() * sizeof(float)), 0);
  EXPECT_NE(std::memcmp(one.data(), other.data(), one.size() * sizeof(float)), 0);
}

TEST(SimulateScan, LosesTheShareThatIsAsked) {
  const Mesh table = table_mesh();
  StructuredLight sensor = small_sensor();
  sensor.lost_share = 0.2;
  const SimulatedScan s = simulate_scan({{&table, camera_above(800, 0, 0), 0.5, 0}}, sensor, 3);
  EXPECT_NEAR(1 - static_cast<double>(valid_count(s.scan)) / s.scan.z_mm.size(), 0.2, 0.03);
}

/// Depth at which a ray from the camera meets a triangle, or infinity. \source Moeller and Trumbore, 1997.
double met(const Vec3& ray, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 e = b - a, f = c - a, p = ray.cross(f), q = (-a).cross(e);
  const double det = e.dot(p), u = (-a).dot(p) / det, v = ray.dot(q) / det, t = f.dot(q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : std::numeric_limits<double>::infinity();
}

TEST(SimulateScan, VisibleFractionsAreThoseOfAnIndependentCount) {
  const Mesh table = table_mesh(), box = box_mesh(60, 40, 30), bar = box_mesh(200, 15, 15);
  StructuredLight sensor = small_sensor();
  sensor.camera = {160, 128, 220, 220, 79.5, 63.5};
  const Pose view = camera_above(800, 0.2, 1);
  Pose above = Pose::Identity();
  above.linear() = rotation_from_vector(Vec3(0.1, 0.2, 0.8));
  above.translation() = Vec3(-40, -60, 60);
  const std::vector<Body> bodies = {{&table, view, 0.3, 0}, {&box, view, 0.5, 0}, {&bar, Pose(view * above), 0.5, 0}};
  const SimulatedScan s = simulate_scan(bodies, sensor, 1);
  std::vector<int> alone(3, 0), seen(3, 0);
  for (int v = 0; v < 128; ++v)
    for (int u = 0; u < 160; ++u) {
      const Vec3 ray = sensor.camera.ray(u, v);
      double nearest = std::numeric_limits<double>::infinity();
      int first = -1;
      for (int b = 0; b < 3; ++b) {
        double t = std::numeric_limits<double>::infinity();
        const auto corner = [&](std::uint32_t i) {
          return Vec3(bodies[b].camera_from_body * Vec3(bodies[b].mesh->vertices[i].cast<double>()));
        };
        for (const auto& k : bodies[b].mesh->triangles)
          t = std::min(t, met(ray, corner(k[0]), corner(k[1]), corner(k[2])));
        if (std::isfinite(t)) ++alone[b];
        if (t < nearest) nearest = t, first = b;
      }
      if (first >= 0) ++seen[first];
    }
  for (int b = 1; b < 3; ++b) {
    SCOPED_TRACE(b);
    EXPECT_GT(seen[b], 100);
    EXPECT_NEAR(s.bodies[b].visible_fraction(), static_cast<double>(seen[b]) / alone[b], 0.01);
    EXPECT_NEAR(s.bodies[b].pixels_visible, seen[b], 2);  // float and double may differ on a rim
  }
  EXPECT_LT(seen[1], 0.95 * alone[1]) << "the bar hides some of the box";
}

TEST(SimulateScan, RefusesSensorsThatCannotBe) {
  StructuredLight sensor;
  sensor.steps = 2;
  EXPECT_THROW(simulate_scan({}, sensor, 1), Error);
  sensor = {};
  sensor.baseline_mm = 0;
  EXPECT_THROW(simulate_scan({}, sensor, 1), Error);
}

}  // namespace
}  // namespace tribin::sim
