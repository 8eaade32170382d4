#include "tribin/capture/triangulate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "synthetic_frames.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kNoise = 2, kModulation = 60;

RigCamera camera_at(const std::string& name, const Vec3& place, double yaw, bool bent) {
  RigCamera c;
  c.name = name;
  c.camera = {kWidth, kHeight, 600, 602, 158.3, 121.7};
  if (bent) c.distortion = {-0.12, 0.2, 0.001, -0.0008, 0.1};
  c.rig_from_camera.linear() = rotation_from_vector(Vec3(0.01, yaw, -0.012));
  c.rig_from_camera.translation() = place;
  return c;
}

RigCamera projector_at(const Vec3& place, double yaw, bool bent) {
  RigCamera p = camera_at("projector", place, yaw, false);
  p.camera = {1280, 800, 1500, 1500, 640, 420};
  if (bent) p.distortion = {0.05, -0.04, 0.0005, 0.001, 0};
  return p;
}

/// A sphere in front of a slanted wall, in the rig's frame.
std::optional<Vec3> hit(const Vec3& from, const Vec3& along) {
  const Vec3 centre(10, -20, 760), normal = Vec3(0.2, -0.1, -1).normalized();
  const double radius = 90, b = along.dot(from - centre), c = (from - centre).squaredNorm() - radius * radius;
  const double a = along.squaredNorm(), root = b * b - a * c;
  if (root > 0) return from + along * ((-b - std::sqrt(root)) / a);
  const double t = normal.dot(Vec3(0, 0, 900) - from) / normal.dot(along);
  return t > 0 ? std::optional<Vec3>(from + along * t) : std::nullopt;
}

/// The point of the scene that a pixel sees.
std::optional<Vec3> seen(const RigCamera& c, double u, double v) {
  const Vec3 ray = c.camera.ray(u, v);
  const std::optional<Vec2> ideal = undistorted(c.distortion, {ray.x(), ray.y()});
  if (!ideal) return std::nullopt;
  return hit(c.rig_from_camera.translation(), c.rig_from_camera.linear() * Vec3(ideal->x(), ideal->y(), 1));
}

/// Decoded coordinates with the noise of phases; NaN where the projector does not shine.
Decoded look(const RigCamera& camera, const RigCamera& projector, bool rows, double noise, unsigned seed) {
  Decoded d;
  d.column = Image<float>(kWidth, kHeight, std::nanf(""));
  if (rows) d.row = d.column;
  d.modulation = Image<std::uint8_t>(kWidth, kHeight, static_cast<std::uint8_t>(kModulation));
  d.brightness = Image<std::uint8_t>(kWidth, kHeight, 100);
  d.invalid_reason = Image<std::uint8_t>(kWidth, kHeight, static_cast<std::uint8_t>(Invalid::dark));
  d.image_noise = noise;
  d.column_noise = d.row_noise = 16 / (2 * kPi) * std::sqrt(2.0 / 4) * noise;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, d.column_noise / kModulation);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const std::optional<Vec3> point = seen(camera, u, v);
      if (!point) continue;
      const Vec3 place = projector.rig_from_camera.translation();
      const std::optional<Vec3> lit = hit(place, *point - place);
      if (!lit || (*lit - *point).norm() > 0.5) continue;  // in the shadow
      const Vec2 pixel = pixel_of(projector, *point);
      const double texture = 40 * std::sin(0.31 * point->y()) * std::cos(0.07 * point->x());
      d.brightness(u, v) = static_cast<std::uint8_t>(std::lround(110 + texture));
      d.column(u, v) = static_cast<float>(pixel.x() + (noise > 0 ? normal(random) : 0));
      if (rows) d.row(u, v) = static_cast<float>(pixel.y() + (noise > 0 ? normal(random) : 0));
      d.invalid_reason(u, v) = 0;
    }
  return d;
}

struct Errors {
  double worst = 0, rms = 0, share = 0, wrong = 0;  ///< wrong: share off by more than 2 mm, in no other figure
};

/// z errors away from the sphere's outline, by casting the scan's own rays.
Errors errors_of(const Triangulated& t) {
  Errors out;
  int count = 0;
  const Scan& s = t.scan;
  const Pose scan_from_rig = t.rig_from_scan.inverse();
  for (int v = 1; v < s.height() - 1; ++v)
    for (int u = 1; u < s.width() - 1; ++u) {
      if (!std::isfinite(s.z_mm(u, v))) continue;
      double z[5];
      bool edge = false;
      const int du[] = {0, -1, 1, 0, 0}, dv[] = {0, 0, 0, -1, 1};
      for (int k = 0; k < 5; ++k) {
        const auto point =
            hit(t.rig_from_scan.translation(), t.rig_from_scan.linear() * s.camera.ray(u + du[k], v + dv[k]));
        z[k] = point ? (scan_from_rig * *point).z() : 1e9;
        edge |= std::abs(z[k] - z[0]) > 8;
      }
      if (edge) continue;
      const double off = s.z_mm(u, v) - z[0];
      if (std::abs(off) > 2) {
        ++out.wrong;
        continue;
      }
      out.worst = std::max(out.worst, std::abs(off));
      out.rms += off * off;
      ++count;
    }
  out.rms = std::sqrt(out.rms / std::max(1, count));
  out.wrong /= std::max(1, count);
  out.share = static_cast<double>(count) / s.z_mm.size();
  return out;
}

TEST(Triangulate, CameraAndProjectorAreExactWithoutNoise) {
  for (const bool bent : {false, true})
    for (const bool rows : {false, true}) {
      Rig rig{{camera_at("c", {3, -2, 1}, 0.02, bent)}, projector_at({200, 5, -10}, -0.22, bent), "rig"};
      const Triangulated t = triangulate(rig, look(rig.cameras[0], *rig.projector, rows, 0, 1));
      const Errors e = errors_of(t);
      EXPECT_GT(e.share, bent ? 0.75 : 0.8);
      EXPECT_LT(e.rms, bent ? 0.02 : 0.001);  // bent: interpolation between pixels of a curved sphere
      EXPECT_LT(e.worst, bent ? 1 : 0.01);
      EXPECT_EQ(e.wrong, 0);
      EXPECT_EQ(t.epipolar.places > 0, rows);
      EXPECT_LT(std::abs(t.epipolar.median_px), 0.01);
      EXPECT_TRUE(t.scan.warnings.empty());
      for (std::size_t i = 0; i < t.scan.z_mm.size(); ++i)
        ASSERT_EQ(std::isfinite(t.scan.z_mm.data[i]), t.scan.invalid_reason.data[i] == 0);
    }
}

TEST(Triangulate, DepthNoiseIsThatOfTheNoiseLaw) {
  // Parallel camera and projector: sigma_z = z^2 / (B f_p) sigma_x, and the scan says so itself.
  Rig rig{{camera_at("c", {0, 0, 0}, 0, false)}, projector_at({200, 0, 0}, 0, false), "rig"};
  rig.cameras[0].rig_from_camera.linear() = rig.projector->rig_from_camera.linear() = Matrix3::Identity();
  rig.projector->camera.cx = 950;
  const Triangulated t = triangulate(rig, look(rig.cameras[0], *rig.projector, false, kNoise, 5));
  double sum = 0, law = 0;
  int count = 0;
  for (int v = 5; v < kHeight - 5; ++v)
    for (int u = 5; u < kWidth - 5; ++u) {
      const auto point = hit(Vec3::Zero(), t.scan.camera.ray(u, v));
      const double z = t.scan.z_mm(u, v);
      if (!point || !std::isfinite(z)) continue;
      const double sigma_x = 16 / (2 * kPi) * std::sqrt(2.0 / 4) * kNoise / kModulation;
      const double sigma = z * z / (200 * 1500.0) * sigma_x;
      sum += std::pow((z - point->z()) / sigma, 2);
      law += sigma;
      ++count;
    }
  EXPECT_GT(count, 40000);
  EXPECT_NEAR(std::sqrt(sum / count), 1, 0.1);
  EXPECT_NEAR(t.scan.noise.sigma_mm / (law / count), 1, 0.1);
}

TEST(Triangulate, TwoCamerasAreExactAndSayTheirNoise) {
  for (const bool bent : {false, true}) {
    Rig rig{{camera_at("left", {-110, 0, 0}, 0.13, bent), camera_at("right", {115, 6, -4}, -0.14, bent)}, {}, "rig"};
    const RigCamera projector = projector_at({5, 10, -30}, 0, true);
    const auto triangulated = [&](double noise) {
      return triangulate(rig, look(rig.cameras[0], projector, false, noise, 1),
                         look(rig.cameras[1], projector, false, noise, 2));
    };
    const Triangulated exact = triangulated(0), noisy = triangulated(kNoise);
    const Errors e = errors_of(exact), n = errors_of(noisy);
    EXPECT_GT(e.share, 0.5);
    EXPECT_LT(e.rms, 0.04);    // the sphere bends over the five pixels of a line
    EXPECT_LT(e.wrong, 1e-3);  // columns that the second camera sees on another surface only
    EXPECT_GT(n.share, 0.95 * e.share);
    EXPECT_NEAR(n.rms / noisy.scan.noise.sigma_mm, 1, 0.2);  // one number for a scene of unlike slopes
    EXPECT_GT(exact.epipolar.places, 3);
    EXPECT_LT(std::abs(exact.epipolar.median_px), 0.1);
    EXPECT_TRUE(exact.scan.warnings.empty());
  }
}

TEST(Triangulate, ATwistedRigIsNoticed) {
  for (const bool rows : {false, true}) {
    Rig rig{{camera_at("left", {-110, 0, 0}, 0.13, false), camera_at("right", {115, 6, -4}, -0.14, false)}, {}, "rig"};
    const RigCamera projector = projector_at({5, 10, -30}, 0, false);
    const Decoded left = look(rig.cameras[0], projector, rows, 0, 1),
                  right = look(rig.cameras[1], projector, rows, 0, 2);
    // The second camera has been pushed up by a pixel and a half.
    rig.cameras[1].rig_from_camera.linear() =
        rig.cameras[1].rig_from_camera.linear() * rotation_from_vector(Vec3(1.5 / 600, 0, 0));
    const Triangulated t = triangulate(rig, left, right);
    EXPECT_NEAR(std::abs(t.epipolar.median_px), 1.5, rows ? 0.1 : 0.5);
    EXPECT_EQ(t.scan.warnings.size(), 1u);
  }
}

TEST(Triangulate, BadRigsAreNamed) {
  Rig rig{{camera_at("c", {0, 0, 0}, 0, false), camera_at("d", {0, 200, 0}, 0, false)}, {}, "rig"};
  const Decoded d = look(rig.cameras[0], projector_at({100, 0, 0}, 0, false), false, 0, 1);
  EXPECT_THROW(triangulate(rig, d), Error);     // no projector
  EXPECT_THROW(triangulate(rig, d, d), Error);  // one above the other
  rig.cameras[0].camera.width = 100;
  EXPECT_THROW(triangulate(rig, d, d), Error);  // another size
}

}  // namespace
}  // namespace tribin
