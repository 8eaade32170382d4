#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tribin/scan/scan.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin::test {

/// A surface that rays can be met with in closed form. Planes are infinite; cylinders have open ends.
struct AnalyticSurface {
  PrimitiveType type = PrimitiveType::plane;
  Vec3 point = Vec3::Zero();  ///< plane: on it; cylinder: middle of the axis; sphere: centre
  Vec3 axis = Vec3::UnitZ();  ///< unit
  double radius = 0;          ///< mm
  double half_length = 1e9;   ///< cylinder [mm]
};

/// Depth along a ray with z = 1 at the nearest meeting from outside, or infinity.
inline double meet(const AnalyticSurface& s, const Vec3& ray) {
  const double none = std::numeric_limits<double>::infinity();
  if (s.type == PrimitiveType::plane) {
    const double t = s.axis.dot(s.point) / s.axis.dot(ray);
    return t > 0 ? t : none;
  }
  Vec3 d = ray, o = -s.point;
  if (s.type == PrimitiveType::cylinder) {
    d -= s.axis * s.axis.dot(d);
    o -= s.axis * s.axis.dot(o);
  }
  const double a = d.squaredNorm(), b = d.dot(o), c = o.squaredNorm() - s.radius * s.radius;
  const double root = b * b - a * c;
  if (root < 0) return none;
  const double t = (-b - std::sqrt(root)) / a;
  if (t <= 0) return none;
  if (s.type == PrimitiveType::cylinder && std::abs(s.axis.dot(ray * t - s.point)) > s.half_length) return none;
  return t;
}

/// Noise of sd 1, correlated over c px: white noise through a Gaussian of sd c, scaled back to sd 1.
inline std::vector<double> correlated_noise(int width, int height, double c, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> noise(static_cast<std::size_t>(width) * height);
  for (double& x : noise) x = normal(random);
  if (c <= 0) return noise;
  const int reach = static_cast<int>(std::ceil(3 * c));
  std::vector<double> kernel;
  double squares = 0;
  for (int i = -reach; i <= reach; ++i) kernel.push_back(std::exp(-0.5 * i * i / (c * c)));
  for (double k : kernel) squares += k * k;
  for (double& k : kernel) k /= std::sqrt(squares);
  std::vector<double> once(noise.size(), 0.0), twice(noise.size(), 0.0);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      for (int i = -reach; i <= reach; ++i)
        once[v * width + u] += kernel[i + reach] * noise[v * width + (u + i + width) % width];
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      for (int i = -reach; i <= reach; ++i)
        twice[v * width + u] += kernel[i + reach] * once[(v + i + height) % height * width + u];
  return twice;
}

struct ScanOptions {
  int width = 320, height = 256;
  double focal_px = 450;
  double sigma_mm = 0.1;
  double correlation_px = 0;
  double quantum_mm = 0;  ///< step of stored depths, 0 = none
};

/// Ray-casts surfaces: nearest one wins, noise on z, nothing behind `far_mm`.
inline Scan cast(const std::vector<AnalyticSurface>& surfaces, const ScanOptions& options, unsigned seed) {
  Scan scan;
  scan.source = "analytic scan " + std::to_string(seed);
  scan.camera = {options.width,
                 options.height,
                 options.focal_px,
                 options.focal_px,
                 0.5 * (options.width - 1),
                 0.5 * (options.height - 1)};
  scan.z_mm = Image<float>(options.width, options.height, std::numeric_limits<float>::quiet_NaN());
  const std::vector<double> noise = correlated_noise(options.width, options.height, options.correlation_px, seed);
  for (int v = 0; v < options.height; ++v)
    for (int u = 0; u < options.width; ++u) {
      double z = std::numeric_limits<double>::infinity();
      for (const AnalyticSurface& s : surfaces) z = std::min(z, meet(s, scan.camera.ray(u, v)));
      if (!std::isfinite(z) || z > 5000) continue;
      z += options.sigma_mm * noise[static_cast<std::size_t>(v) * options.width + u];
      if (options.quantum_mm > 0) z = std::round(z / options.quantum_mm) * options.quantum_mm;
      scan.z_mm(u, v) = static_cast<float>(z);
    }
  return scan;
}

/// A unit vector, uniform on the sphere.
inline Vec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Vec3(normal(random), normal(random), normal(random)).normalized();
}

}  // namespace tribin::test
