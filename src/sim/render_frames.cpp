#include "tribin/sim/render_frames.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/noise_field.hpp"
#include "sim/random.hpp"
#include "sim/surface_light.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::sim {
namespace {

constexpr int kRows = 16;
constexpr int kFiner = 8;  // samples of a pattern's profile a projector pixel

void check(const StructuredLight& s, const RenderOptions& o) {
  check_sensor(s);
  const auto want = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::out_of_range, std::string("rendered frames: wanted ") + what);
  };
  want(!o.patterns.empty(), "one pattern or more");
  want(o.projector_width >= 8 && o.projector_width <= 16384 && o.projector_height >= 8 && o.projector_height <= 16384,
       "a projector of 8 to 16384 px a side");
  want(o.ambient >= 0, "ambient >= 0");
  want(o.defocus_px >= 0 && o.defocus_px <= 50, "defocus_px in [0, 50]");
  want(o.gamma > 0 && o.gamma <= 4, "gamma in (0, 4]");
  want(o.bounce_rays >= 0 && o.bounce_rays <= 65536, "bounce_rays in [0, 65536]");
}

/// A pattern's light across the projector, sampled kFiner times a pixel.
class Profile {
 public:
  Profile(const Pattern& pattern, const RenderOptions& o) : row_(pattern.axis == PatternAxis::row) {
    const Image<std::uint8_t> picture = draw_pattern(pattern, o.projector_width, o.projector_height);
    const int n = row_ ? picture.height : picture.width;
    std::vector<double> light(static_cast<std::size_t>(n) * kFiner);
    for (int i = 0; i < n * kFiner; ++i) {
      const int px = i / kFiner;
      light[i] = std::pow((row_ ? picture(0, px) : picture(px, 0)) / 255.0, o.gamma);
    }
    // The blur of the lens; at the picture's edge nothing comes in from beyond.
    const int reach = static_cast<int>(std::ceil(4 * o.defocus_px * kFiner));
    std::vector<double> kernel(2 * reach + 1);
    double sum = 0;
    for (int k = -reach; k <= reach; ++k)
      sum += kernel[k + reach] =
          reach > 0 ? std::exp(-0.5 * k * k / (o.defocus_px * o.defocus_px * kFiner * kFiner)) : 1;
    light_.resize(light.size());
    for (int i = 0; i < n * kFiner; ++i) {
      double value = 0;
      for (int k = std::max(-reach, -i); k <= std::min(reach, n * kFiner - 1 - i); ++k)
        value += kernel[k + reach] * light[i + k];
      light_[i] = static_cast<float>(value / sum);
    }
  }

  /// \param at  from the left upper edge of the first pixel. \return 0 beyond the picture.
  float operator()(const Vec2& at) const {
    const double t = (row_ ? at.y() : at.x()) * kFiner - 0.5;
    const auto last = static_cast<double>(light_.size() - 1);
    if (!(t >= 0 && t < last)) return 0;
    const auto i = static_cast<std::size_t>(t);
    const auto f = static_cast<float>(t - std::floor(t));
    return light_[i] + f * (light_[i + 1] - light_[i]);
  }

 private:
  bool row_;
  std::vector<float> light_;
};

/// How much blur and pixel take from the modulation of the finest fringes.
double contrast(const StructuredLight& s, const RenderOptions& o) {
  const double a = kPi / s.fringe_period_px, b = 2 * kPi * o.defocus_px / s.fringe_period_px;
  return std::sin(a) / a * std::exp(-0.5 * b * b);
}

/// Light of one place of the projector in a pixel.
struct Share {
  Vec2 at;      ///< place in the projector's picture
  double grey;  ///< grey levels where the pattern is full
};

/// All light of a pixel but noise.
struct PixelLight {
  double constant = 0;
  std::vector<Share> shares;
};

class Lighting {
 public:
  Lighting(const std::vector<Body>& bodies, const StructuredLight& s, const RenderOptions& o)
      : bodies_(bodies),
        s_(s),
        o_(o),
        scene_(bodies),
        rig_(rig_of(s, o)),
        full_(2 / contrast(s, o)),
        least_cos_(std::cos(s.max_incidence)) {}

  const RayScene& scene() const { return scene_; }

  /// Adds the light that comes from a surface along -ray. \param weight  share of the pixel.
  void add(const Hit& hit, const Vec3& ray, double weight, PixelLight& out) const {
    if (hit.body < 0) return;
    const Body& body = bodies_[hit.body];
    const Vec3 point = ray * hit.t;
    out.constant += weight * o_.ambient * body.albedo / 0.5;
    add_direct(point, hit.normal, -ray.normalized(), body, weight, out);
    const double mirror = s_.mirror_share * body.shine;
    if (mirror <= 0) return;
    const Vec3 on = ray - 2 * ray.dot(hit.normal) * hit.normal;
    const Hit second = scene_.next_hit(point, on);
    if (second.body < 0) return;
    add_direct(point + second.t * on, second.normal, -on.normalized(), bodies_[second.body], weight * mirror, out);
  }

  /// One diffuse bounce: the mean over directions of the light of other surfaces, by the surface's albedo.
  void add_bounce(const Hit& hit, const Vec3& ray, Random& random, PixelLight& out) const {
    const Vec3 point = ray * hit.t;
    Vec3 a, b;
    orthonormal_basis(hit.normal, a, b);
    // Directions by a lattice (golden ratio), moved by chance in each pixel: denser where they count more (Malley).
    constexpr double kGolden = 0.6180339887498949;
    const double shift_x = random.uniform(), shift_y = random.uniform();
    const double weight = bodies_[hit.body].albedo / o_.bounce_rays;
    for (int i = 0; i < o_.bounce_rays; ++i) {
      const double u = std::fmod((i + 0.5) / o_.bounce_rays + shift_x, 1.0), w = std::fmod(kGolden * i + shift_y, 1.0);
      const double r = std::sqrt(u), phi = 2 * kPi * w;
      const Vec3 d = r * std::cos(phi) * a + r * std::sin(phi) * b + std::sqrt(1 - u) * hit.normal;
      const Hit second = scene_.next_hit(point, d);
      if (second.body < 0) continue;
      const Body& body = bodies_[second.body];
      const Vec3 q = point + second.t * d;
      const SurfaceLight light = light_at(scene_, s_, q, second.normal, -d, body);
      if (light.lit) out.shares.push_back({projected(q), weight * full_ * light.diffuse});
    }
  }

 private:
  Vec2 projected(const Vec3& point) const { return pixel_of(*rig_.projector, point) + Vec2(0.5, 0.5); }

  void add_direct(const Vec3& point, const Vec3& normal, const Vec3& eye, const Body& body, double weight,
                  PixelLight& out) const {
    const SurfaceLight light = light_at(scene_, s_, point, normal, eye, body);
    if (!light.lit || std::min(light.cos_light, light.cos_eye) < least_cos_) return;
    out.shares.push_back({projected(point), weight * full_ * (light.diffuse + lobe_modulation(s_) * light.lobe)});
  }

  const std::vector<Body>& bodies_;
  const StructuredLight& s_;
  const RenderOptions& o_;
  RayScene scene_;
  Rig rig_;
  double full_;       ///< grey levels of full light a level of modulation
  double least_cos_;  ///< rough surfaces shadow and mask themselves beyond this incidence: no light comes back
};

}  // namespace

Rig rig_of(const StructuredLight& sensor, const RenderOptions& options) {
  Rig rig;
  rig.cameras.push_back({"camera", sensor.camera, {0, 0, 0, 0, 0}, Pose::Identity()});
  RigCamera projector;
  projector.name = "projector";
  const double f = sensor.projector_focal_px;
  projector.camera = {options.projector_width,
                      options.projector_height,
                      f,
                      f,
                      (options.projector_width - 1) / 2.0 + f * sensor.baseline_mm / sensor.reference_mm,
                      (options.projector_height - 1) / 2.0};
  projector.rig_from_camera.translation() = Vec3(sensor.baseline_mm, 0, 0);
  rig.projector = projector;
  return rig;
}

FrameStack render_frames(const std::vector<Body>& bodies, const StructuredLight& sensor, const RenderOptions& options,
                         std::uint64_t seed) {
  check(sensor, options);
  const PinholeCamera& camera = sensor.camera;
  const int w = camera.width, h = camera.height;
  const std::size_t frames = options.patterns.size();
  std::vector<Profile> profiles;
  for (const Pattern& pattern : options.patterns) profiles.emplace_back(pattern, options);

  const Lighting lighting(bodies, sensor, options);
  Image<std::int16_t> body(w, h, -1);
  Image<float> z(w, h, std::numeric_limits<float>::quiet_NaN());
  Image<Hit> hits(w, h);
  parallel_ranges(h, kRows, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < w; ++u) {
        const Hit hit = hits(u, v) = lighting.scene().first_hit(camera.ray(u, v));
        if (hit.body < 0) continue;
        body(u, v) = static_cast<std::int16_t>(hit.body);
        z(u, v) = static_cast<float>(hit.t);
      }
  });

  std::vector<Image<float>> light(frames, Image<float>(w, h, 0));
  const double break_mm = edge_limit(sensor);
  parallel_ranges(h, kRows, [&](int begin, int end) {
    PixelLight pixel;
    for (int v = begin; v < end; ++v) {
      Random random(mixed(seed ^ 0xB0117CEu) ^ static_cast<std::uint64_t>(v));
      for (int u = 0; u < w; ++u) {
        pixel.constant = 0;
        pixel.shares.clear();
        const Vec3 ray = camera.ray(u, v);
        const bool edge = sensor.mixed_pixels && on_edge(body, z, u, v, break_mm);
        lighting.add(hits(u, v), ray, edge ? 0.2 : 1.0, pixel);
        if (edge)
          for (const auto& offset : kSubSamples) {
            const Vec3 r = camera.ray(u + offset[0], v + offset[1]);
            lighting.add(lighting.scene().first_hit(r), r, 0.2, pixel);
          }
        if (options.bounce_rays > 0 && hits(u, v).body >= 0) lighting.add_bounce(hits(u, v), ray, random, pixel);
        for (std::size_t i = 0; i < frames; ++i) {
          double sum = pixel.constant;
          for (const Share& share : pixel.shares) sum += share.grey * profiles[i](share.at);
          light[i](u, v) = static_cast<float>(sum);
        }
      }
    }
  });

  FrameStack out;
  out.camera = "camera";
  out.patterns = options.patterns;
  out.projector_width = options.projector_width;
  out.projector_height = options.projector_height;
  out.grey8.assign(frames, Image<std::uint8_t>(w, h));
  for (std::size_t i = 0; i < frames; ++i) {
    const Image<float> noise = noise_field(w, h, sensor.noise_correlation_px, mixed(seed + 0x1000 * (i + 1)));
    for (std::size_t k = 0; k < noise.size(); ++k) {
      const double value = light[i].data[k] + sensor.image_noise * noise.data[k];
      out.grey8[i].data[k] = static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
    }
    light[i] = {};
    out.files.push_back(pattern_file_name(options.patterns, i));
  }
  return out;
}

}  // namespace tribin::sim
