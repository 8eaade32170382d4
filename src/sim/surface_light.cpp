#include "sim/surface_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tribin/core/error.hpp"

namespace tribin::sim {

void check_sensor(const StructuredLight& s) {
  const auto want = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::out_of_range, std::string("simulated sensor: wanted ") + what);
  };
  want(s.camera.width > 0 && s.camera.height > 0 && s.camera.fx > 0 && s.camera.fy > 0,
       "a camera with width, height, fx, fy > 0");
  want(s.baseline_mm > 0 && s.projector_focal_px > 0 && s.fringe_period_px > 0,
       "baseline_mm, projector_focal_px, fringe_period_px > 0");
  want(s.steps >= 3, "steps >= 3");
  want(s.image_noise >= 0 && s.noise_mm >= 0, "image_noise and noise_mm >= 0");
  want(s.noise_correlation_px >= 0 && s.noise_correlation_px <= 5, "noise_correlation_px in [0, 5]");
  want(s.mirror_share >= 0 && s.mirror_share <= 1, "mirror_share in [0, 1]");
  want(s.lost_share >= 0 && s.lost_share < 1, "lost_share in [0, 1)");
  want(s.facing_modulation > 0 && s.reference_mm > 0, "facing_modulation and reference_mm > 0");
}

double facing_sigma(const StructuredLight& s) {
  if (s.noise_mm > 0) return s.noise_mm;
  const double grey = std::hypot(s.image_noise, std::sqrt(1.0 / 12));  // with the rounding of 8 bit
  return s.reference_mm * s.reference_mm / (s.baseline_mm * s.projector_focal_px) * s.fringe_period_px / (2 * kPi) *
         std::sqrt(2.0 / s.steps) * grey / s.facing_modulation;
}

double edge_limit(const StructuredLight& s) { return std::max(0.05, 2 * facing_sigma(s)); }

SurfaceLight light_at(const RayScene& scene, const StructuredLight& s, const Vec3& point, const Vec3& normal,
                      const Vec3& eye, const Body& body) {
  const Vec3 projector(s.baseline_mm, 0, 0), to_light = projector - point, l = to_light.normalized();
  SurfaceLight light;
  light.cos_light = normal.dot(l);
  light.cos_eye = normal.dot(eye);
  if (light.cos_light <= 0 || scene.occluded(point, projector)) return light;
  light.lit = true;
  // In units of a facing surface on the axis at the reference distance, which the projector meets slightly aslant.
  const double reference = std::hypot(s.reference_mm, s.baseline_mm);
  const double falloff = reference / to_light.norm();
  light.diffuse =
      s.facing_modulation * (body.albedo / 0.5) * light.cos_light * (reference / s.reference_mm) * falloff * falloff;
  const double half = normal.dot((l + eye).normalized());
  // Below 0.9 the lobe is less than 1e-9.
  if (half > 0.9) light.lobe = body.shine * s.highlight * std::pow(half, 200) * falloff * falloff;
  return light;
}

bool on_edge(const Image<std::int16_t>& bodies, const Image<float>& z, int u, int v, double limit) {
  const int body = bodies(u, v);
  for (const auto [du, dv] : {std::array{1, 0}, std::array{0, 1}}) {
    const int a = u - du, b = v - dv, c = u + du, d = v + dv;
    if (!bodies.contains(a, b) || !bodies.contains(c, d)) continue;
    if (bodies(a, b) != body || bodies(c, d) != body) return true;
    if (body >= 0 && std::abs(z(a, b) - 2 * z(u, v) + z(c, d)) > limit) return true;
  }
  return false;
}

}  // namespace tribin::sim
