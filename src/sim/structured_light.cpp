#include "tribin/sim/structured_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>

#include "sim/noise_field.hpp"
#include "sim/random.hpp"
#include "sim/ray_scene.hpp"
#include "sim/surface_light.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::sim {
namespace {

constexpr int kRows = 32;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// The light that comes back from one point.
struct Return {
  double modulation = 0;  ///< grey levels
  Invalid state = Invalid::nothing_there;
};

/// \param eye  unit, from the point to who looks at it.
Return light_of(const RayScene& scene, const StructuredLight& s, const Vec3& point, const Vec3& normal, const Vec3& eye,
                const Body& body) {
  const SurfaceLight light = light_at(scene, s, point, normal, eye, body);
  if (!light.lit) return {0, Invalid::shadow};
  if (std::min(light.cos_light, light.cos_eye) < std::cos(s.max_incidence)) return {light.diffuse, Invalid::grazing};
  if (light.lobe > 0.45 + 0.1 * (1 - light.cos_light)) return {light.diffuse, Invalid::saturated};
  return {light.diffuse, Invalid::measured};
}

Return light_of(const RayScene& scene, const StructuredLight& s, const Hit& hit, const Vec3& ray,
                const std::vector<Body>& bodies) {
  if (hit.body < 0) return {};
  return light_of(scene, s, ray * hit.t, hit.normal, -ray.normalized(), bodies[hit.body]);
}

/// The value that a standard normal exceeds with this probability.
double upper_quantile(double share) {
  double low = -8, high = 8;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > share ? low : high) = middle;
  }
  return low;
}

/// Whether a decoder reads a pixel of this modulation, or finds it dark, or a code bit uncertain: by chance, near the
/// limits, as image noise falls.
/// \source ours: a bit is uncertain within 2 sd of its threshold, the mean of white and black (so sd sqrt(1.5)), which
/// a
///         level lies one modulation from; 8 bits and complements tell 128 fringes apart.
Invalid readable(const StructuredLight& s, double modulation, std::uint64_t seed, int u, int v) {
  const double sd = s.image_noise;
  if (modulation > 6 * std::max(sd, s.min_modulation / 3)) return Invalid::measured;
  if (sd <= 0) return modulation < s.min_modulation ? Invalid::dark : Invalid::measured;
  const auto below = [](double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); };
  Random random(mixed(seed ^ 0xDA2Cu) ^ (static_cast<std::uint64_t>(v) << 32 | static_cast<std::uint32_t>(u)));
  if (random.uniform() < below((s.min_modulation - modulation) / (sd * std::sqrt(2.0 / s.steps)))) return Invalid::dark;
  const double one_bit = below((2 * sd - modulation) / (sd * std::sqrt(1.5)));
  return random.uniform() < 1 - std::pow(1 - one_bit, 8) ? Invalid::uncertain_bit : Invalid::measured;
}

/// A camera of 8 bit rounds its grey levels: white noise of sd 1 / sqrt(12) of them, whatever correlates the rest.
void add_rounding(const StructuredLight& s, std::uint64_t seed, Image<float>& noise) {
  if (s.noise_mm > 0 || s.image_noise <= 0) return;
  const Image<float> white = noise_field(noise.width, noise.height, 0, mixed(seed ^ 0x8B17u));
  const auto share = static_cast<float>(std::sqrt(1.0 / 12) / s.image_noise);
  for (std::size_t i = 0; i < noise.size(); ++i)
    noise.data[i] = (noise.data[i] + share * white.data[i]) / std::sqrt(1 + share * share);
}

/// One measured value: depth and modulation.
struct Measured {
  double z = 0;
  Return light;
};

/// The fringes of several points in one pixel: phasors add, the phase is read near the middle's.
Measured mixed_pixel(const RayScene& scene, const StructuredLight& s, const std::vector<Body>& bodies, int u, int v,
                     const Hit& middle, const Return& middle_light) {
  // The pixel's square by four sub-samples and its middle.
  const double scale = 2 * kPi / s.fringe_period_px;
  const Vec3 ray = s.camera.ray(u, v);
  // Column of the projector that lights depth z on a ray: f_p (x / z - B / z), with x / z from the ray.
  const auto column = [&](const Vec3& r, double z) { return s.projector_focal_px * (r.x() - s.baseline_mm / z); };
  const double at = column(ray, middle.t);
  std::complex<double> sum = 0;
  int count = 0;
  const auto add = [&](double x, const Return& light) {
    ++count;
    if (light.state == Invalid::measured || light.state == Invalid::dark || light.state == Invalid::grazing)
      sum += light.modulation * std::polar(1.0, scale * (x - at));
  };
  if (middle.body >= 0) add(at, middle_light);
  for (const auto& offset : kSubSamples) {
    const Vec3 r = s.camera.ray(u + offset[0], v + offset[1]);
    const Hit hit = scene.first_hit(r);
    if (hit.body < 0) {
      ++count;
      continue;
    }
    // The sub-ray's own place in the image belongs to the pixel's middle: the phase is compared at equal x / z.
    add(column(r, hit.t) - s.projector_focal_px * (r.x() - ray.x()), light_of(scene, s, hit, r, bodies));
  }
  Measured result{middle.t, middle_light};
  result.light.modulation = std::abs(sum) / count;
  if (result.light.state != Invalid::measured) return result;
  const double x = at + std::arg(sum) / scale;
  result.z = s.baseline_mm / (ray.x() - x / s.projector_focal_px);
  return result;
}

/// Adds the fringes that a pixel sees in its surface as in a mirror. The stronger of the two tells the order of the
/// fringe, as a code would; in the projector's shadow that may be the mirrored one: a ghost.
void add_mirrored(const RayScene& scene, const StructuredLight& s, const std::vector<Body>& bodies, const Vec3& ray,
                  const Hit& hit, Measured& m) {
  const double share = s.mirror_share * bodies[hit.body].shine;
  if (share <= 0 || m.light.state == Invalid::saturated) return;
  const Vec3 point = ray * hit.t, on = ray - 2 * ray.dot(hit.normal) * hit.normal;
  const Hit second = scene.next_hit(point, on);
  if (second.body < 0) return;
  const Vec3 q = point + second.t * on;
  const Return light = light_of(scene, s, q, second.normal, -on.normalized(), bodies[second.body]);
  if (light.state != Invalid::measured) return;
  const double own = m.light.state == Invalid::measured ? m.light.modulation : 0, other = share * light.modulation;
  const double scale = 2 * kPi / s.fringe_period_px;
  const double x_own = s.projector_focal_px * (ray.x() - s.baseline_mm / m.z),
               x_other = s.projector_focal_px * (q.x() - s.baseline_mm) / q.z();
  const std::complex<double> sum = own + other * std::polar(1.0, scale * (x_other - x_own));
  // What is too weak to be read keeps its own reason.
  if (std::abs(sum) < s.min_modulation && own == 0) return;
  const double base = own >= other ? x_own : x_other;
  const double x = base + std::arg(sum * std::polar(1.0, scale * (x_own - base))) / scale;
  const double z = s.baseline_mm / (ray.x() - x / s.projector_focal_px);
  m.light = {std::abs(sum), Invalid::measured};
  // A decoder knows its working range: half to twice the distance.
  if (z > 0.5 * s.reference_mm && z < 2 * s.reference_mm)
    m.z = z;
  else
    m.light.state = Invalid::out_of_view;
}

/// Silhouette of one body, were it alone. Where it is seen, no ray need be cast again.
void count_silhouette(const Body& body, int index, const Image<std::int16_t>& seen, const PinholeCamera& camera,
                      BodyTruth& truth) {
  if (!body.counted) return;
  double u0 = 1e9, v0 = 1e9, u1 = -1e9, v1 = -1e9;
  for (const Vec3f& vertex : body.mesh->vertices) {
    const Vec3 p = body.camera_from_body * Vec3(vertex.cast<double>());
    if (p.z() <= 1) return;  // reaches behind the camera: no silhouette to speak of (a table)
    const Vec2 q = camera.project(p);
    u0 = std::min(u0, q.x()), u1 = std::max(u1, q.x()), v0 = std::min(v0, q.y()), v1 = std::max(v1, q.y());
  }
  const int left = std::clamp(static_cast<int>(std::floor(u0)), 0, camera.width - 1);
  const int right = std::clamp(static_cast<int>(std::ceil(u1)), 0, camera.width - 1);
  const int top = std::clamp(static_cast<int>(std::floor(v0)), 0, camera.height - 1);
  const int bottom = std::clamp(static_cast<int>(std::ceil(v1)), 0, camera.height - 1);
  const RayScene alone({body});
  int x0 = camera.width, x1 = -1, y0 = camera.height, y1 = -1;
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u)
      if (seen(u, v) == index || alone.first_hit(camera.ray(u, v)).body >= 0) {
        ++truth.pixels_all;
        x0 = std::min(x0, u), x1 = std::max(x1, u), y0 = std::min(y0, v), y1 = std::max(y1, v);
      }
  if (x1 >= 0)
    truth.box_all[0] = x0, truth.box_all[1] = y0, truth.box_all[2] = x1 - x0 + 1, truth.box_all[3] = y1 - y0 + 1;
}

/// Counts and boxes of what is seen of each body.
void count_visible(SimulatedScan& out) {
  for (int v = 0; v < out.body.height; ++v)
    for (int u = 0; u < out.body.width; ++u) {
      if (out.body(u, v) < 0) continue;
      BodyTruth& truth = out.bodies[out.body(u, v)];
      int(&box)[4] = truth.box_visible;  // as corners, until all is counted
      if (truth.pixels_visible++ == 0) box[0] = box[2] = u, box[1] = box[3] = v;
      box[0] = std::min(box[0], u), box[2] = std::max(box[2], u), box[3] = v;
      truth.pixels_measured += std::isfinite(out.scan.z_mm(u, v));
    }
  for (BodyTruth& truth : out.bodies)
    if (truth.pixels_visible > 0)
      truth.box_visible[2] += 1 - truth.box_visible[0], truth.box_visible[3] += 1 - truth.box_visible[1];
}

}  // namespace

SimulatedScan simulate_scan(const std::vector<Body>& bodies, const StructuredLight& given, std::uint64_t seed) {
  check_sensor(given);
  StructuredLight sensor = given;
  if (sensor.min_modulation == 0) sensor.min_modulation = 5 * sensor.image_noise * std::sqrt(2.0 / sensor.steps);
  for (const Body& body : bodies) TRIBIN_ASSERT(body.mesh != nullptr);
  const PinholeCamera& camera = sensor.camera;
  const int w = camera.width, h = camera.height;
  SimulatedScan out;
  out.true_z = Image<float>(w, h, kNaN);
  out.body = Image<std::int16_t>(w, h, -1);
  out.face = Image<std::int32_t>(w, h, 0);
  out.normal = Image<Vec3f>(w, h, Vec3f::Zero());
  out.sigma_mm = Image<float>(w, h, 0);
  out.scan.z_mm = Image<float>(w, h, kNaN);
  out.scan.modulation = Image<std::uint8_t>(w, h, 0);
  out.scan.invalid_reason = Image<std::uint8_t>(w, h, static_cast<std::uint8_t>(Invalid::nothing_there));
  out.scan.camera = camera;
  out.scan.source = "simulated";

  const RayScene scene(bodies);
  Image<Hit> hits(w, h);
  parallel_ranges(h, kRows, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < w; ++u) {
        const Hit hit = scene.first_hit(camera.ray(u, v));
        hits(u, v) = hit;
        if (hit.body < 0) continue;
        const Mesh& mesh = *bodies[hit.body].mesh;
        out.body(u, v) = static_cast<std::int16_t>(hit.body);
        out.true_z(u, v) = static_cast<float>(hit.t);
        out.normal(u, v) = hit.normal.cast<float>();
        out.face(u, v) = mesh.face_of_triangle.empty() ? static_cast<std::int32_t>(hit.triangle) + 1
                                                       : mesh.face_of_triangle[hit.triangle];
      }
  });

  const double sigma0 = facing_sigma(sensor), break_mm = edge_limit(sensor);
  Image<float> noise = noise_field(w, h, sensor.noise_correlation_px, seed);
  add_rounding(sensor, seed, noise);
  // The systematic error: a quadratic over the image with coefficients in [-1, 1], scaled so that it stays below 1.
  Random random(mixed(seed) ^ 0x5E57E3A71Cu);
  std::array<double, 6> c{};
  double sum = 0;
  for (double& k : c) k = random.uniform(-1, 1), sum += std::abs(k);
  for (double& k : c) k /= sum;

  // Blots of some pixels: where a smooth field of sd 1 is above the level that the share asks for.
  const Image<float> blots = sensor.lost_share > 0 ? noise_field(w, h, 3, mixed(seed ^ 0xB107u)) : Image<float>();
  const double lost_above = sensor.lost_share > 0 ? upper_quantile(sensor.lost_share) : 0;

  parallel_ranges(h, kRows, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < w; ++u) {
        const Hit& hit = hits(u, v);
        if (hit.body < 0) continue;
        const Vec3 ray = camera.ray(u, v);
        Measured m{hit.t, light_of(scene, sensor, hit, ray, bodies)};
        if (sensor.mixed_pixels && on_edge(out.body, out.true_z, u, v, break_mm))
          m = mixed_pixel(scene, sensor, bodies, u, v, hit, m.light);
        if (sensor.mirror_share > 0) add_mirrored(scene, sensor, bodies, ray, hit, m);
        if (m.light.state == Invalid::measured) m.light.state = readable(sensor, m.light.modulation, seed, u, v);
        if (!blots.empty() && blots(u, v) > lost_above) m.light.state = Invalid::lost;
        out.scan.invalid_reason(u, v) = static_cast<std::uint8_t>(m.light.state);
        if (m.light.state != Invalid::measured) continue;
        const double range = m.z / sensor.reference_mm;
        const double sigma = sigma0 * range * range * sensor.facing_modulation / m.light.modulation;
        const double x = 2.0 * u / w - 1, y = 2.0 * v / h - 1;
        const double error =
            sensor.systematic * (c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y);
        out.sigma_mm(u, v) = static_cast<float>(sigma);
        out.scan.modulation(u, v) = static_cast<std::uint8_t>(std::clamp(m.light.modulation, 0.0, 255.0));
        out.scan.z_mm(u, v) = static_cast<float>(m.z * (sensor.scale + error) + sigma * noise(u, v));
      }
  });

  for (const Body& body : bodies) {
    BodyTruth truth;
    truth.camera_from_body = body.camera_from_body;
    out.bodies.push_back(truth);
  }
  parallel_each(static_cast<int>(bodies.size()),
                [&](int b) { count_silhouette(bodies[b], b, out.body, camera, out.bodies[b]); });
  count_visible(out);
  return out;
}

}  // namespace tribin::sim
