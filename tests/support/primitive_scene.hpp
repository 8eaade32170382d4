#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "support/analytic_scan.hpp"

namespace tribin::test {

/// A solid of revolution with flat ends: cylinder, frustum of a cone, or a whole sphere.
struct Body {
  PrimitiveType type = PrimitiveType::cylinder;
  Vec3 point = Vec3::Zero();  ///< middle of the axis; sphere: centre [mm]
  Vec3 axis = Vec3::UnitZ();  ///< unit; a cone widens along it
  double radius = 0;          ///< mm; cone: at the middle
  double half_length = 0;     ///< mm
  double half_angle = 0;      ///< cone [rad]

  double reach() const {  ///< radius of a ball about `point` that holds it
    if (type == PrimitiveType::sphere) return radius;
    return std::hypot(half_length, radius + half_length * std::tan(half_angle));
  }
  /// Distance of a point from the round surface, continued beyond its ends.
  double distance(const Vec3& p) const {
    const Vec3 q = p - point;
    if (type == PrimitiveType::sphere) return q.norm() - radius;
    const double t = axis.dot(q);
    return ((q - axis * t).norm() - radius) * std::cos(half_angle) - t * std::sin(half_angle);
  }
};

struct Hit {
  double z = std::numeric_limits<double>::infinity();
  bool round = false;  ///< on the round surface, not on an end
};

/// Nearest meeting of a ray with z = 1 with a body that is seen from outside.
inline Hit meet(const Body& b, const Vec3& ray) {
  Hit hit;
  const Vec3 o = -b.point;
  if (b.type == PrimitiveType::sphere) {
    const double a = ray.squaredNorm(), h = ray.dot(o), root = h * h - a * (o.squaredNorm() - b.radius * b.radius);
    if (root > 0) hit = {(-h - std::sqrt(root)) / a, true};
    return hit;
  }
  const double k = std::tan(b.half_angle), dt = b.axis.dot(ray), ot = b.axis.dot(o);
  const Vec3 d = ray - b.axis * dt, p = o - b.axis * ot;
  const double r0 = b.radius + k * ot;
  const double a = d.squaredNorm() - k * k * dt * dt, h = d.dot(p) - k * dt * r0, c = p.squaredNorm() - r0 * r0;
  const double root = h * h - a * c;
  if (root > 0 && std::abs(a) > 1e-12)
    for (double s : {(-h - std::sqrt(root)) / a, (-h + std::sqrt(root)) / a}) {
      const double t = ot + s * dt;
      if (s > 0 && s < hit.z && std::abs(t) <= b.half_length && b.radius + k * t > 0) hit = {s, true};
    }
  for (double end : {-b.half_length, b.half_length}) {
    const double s = (end - ot) / dt;
    if (s > 0 && s < hit.z && (p + d * s).norm() <= b.radius + k * end) hit = {s, false};
  }
  return hit;
}

struct PrimitiveScene {
  std::vector<Body> bodies;
  Scan scan;
  std::vector<std::vector<Vec3>> visible;  ///< per body: exact places of the pixels that show its round surface
};

struct PrimitiveSceneOptions {
  int width = 1280, height = 800;
  double focal_px = 1600;
  double floor_mm = 850;  ///< about 0.5 mm a pixel
  double sigma_mm = 0.1;
  double correlation_px = 0;
  int cylinders = 14, cones = 0, spheres = 0;
};

/// Bodies at random in a bin's volume above a floor, none inside another, rendered with noise and without what is seen
/// at more than 80 deg.
inline PrimitiveScene primitive_scene(const PrimitiveSceneOptions& o, unsigned seed) {
  PrimitiveScene scene;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto between = [&](double low, double high) { return low + (high - low) * unit(random); };
  const double half_width = 0.45 * o.width / o.focal_px, half_height = 0.45 * o.height / o.focal_px;
  const int total = o.cylinders + o.cones + o.spheres;
  for (int i = 0, tries = 0; i < total && tries < 20000; ++tries) {
    Body b;
    b.type = i < o.cylinders             ? PrimitiveType::cylinder
             : i < o.cylinders + o.cones ? PrimitiveType::cone
                                         : PrimitiveType::sphere;
    b.radius = 8 * std::pow(4.0, unit(random));  // 8 to 32 mm, as often small as large
    b.half_length = between(15, 60);
    const double yaw = between(0, 2 * kPi), tilt = between(-40, 40) * kDegree;
    b.axis = Vec3(std::cos(tilt) * std::cos(yaw), std::cos(tilt) * std::sin(yaw), std::sin(tilt));
    if (b.type == PrimitiveType::cone) {
      b.half_angle = between(8, 30) * kDegree;
      b.half_length = std::min(b.half_length, 0.8 * b.radius / std::tan(b.half_angle));
    }
    const double z = o.floor_mm - b.reach() - between(0, 200);
    b.point = Vec3(z * between(-half_width, half_width), z * between(-half_height, half_height), z);
    // Balls strung on the axes must not meet.
    const auto inside = [&](const Body& other) {
      for (int k = -4; k <= 4; ++k)
        for (int l = -4; l <= 4; ++l) {
          const double s = b.half_length * k / 4, t = other.half_length * l / 4;
          const bool ball = b.type == PrimitiveType::sphere, ball2 = other.type == PrimitiveType::sphere;
          const Vec3 p = b.point + b.axis * (ball ? 0 : s), q = other.point + other.axis * (ball2 ? 0 : t);
          const double ra = b.radius + (ball ? 0 : s * std::tan(b.half_angle));
          const double rb = other.radius + (ball2 ? 0 : t * std::tan(other.half_angle));
          if ((p - q).norm() < ra + rb) return true;
        }
      return false;
    };
    if (std::any_of(scene.bodies.begin(), scene.bodies.end(), inside)) continue;
    scene.bodies.push_back(b);
    ++i;
  }

  Scan& scan = scene.scan;
  scan.source = "primitive scene " + std::to_string(seed);
  scan.camera = {o.width, o.height, o.focal_px, o.focal_px, 0.5 * (o.width - 1), 0.5 * (o.height - 1)};
  Image<float> z(o.width, o.height, static_cast<float>(o.floor_mm));
  Image<int> label(o.width, o.height, -1);
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const Body& b = scene.bodies[i];
    const double reach = b.reach(), near = b.point.z() - reach;
    const double u = scan.camera.cx + o.focal_px * b.point.x() / b.point.z(), du = o.focal_px * reach / near * 1.2;
    const double v = scan.camera.cy + o.focal_px * b.point.y() / b.point.z();
    for (int y = std::max(0, static_cast<int>(v - du)); y <= std::min(o.height - 1, static_cast<int>(v + du)); ++y)
      for (int x = std::max(0, static_cast<int>(u - du)); x <= std::min(o.width - 1, static_cast<int>(u + du)); ++x) {
        const Hit hit = meet(b, scan.camera.ray(x, y));
        if (!(hit.z < z(x, y))) continue;
        z(x, y) = static_cast<float>(hit.z);
        label(x, y) = hit.round ? static_cast<int>(i) : -1;
      }
  }
  scan.z_mm = Image<float>(o.width, o.height, std::numeric_limits<float>::quiet_NaN());
  scene.visible.resize(scene.bodies.size());
  const std::vector<double> noise = correlated_noise(o.width, o.height, o.correlation_px, seed);
  const double least_facing = std::cos(80 * kDegree);
  for (int y = 0; y < o.height; ++y)
    for (int x = 0; x < o.width; ++x) {
      const Vec3 ray = scan.camera.ray(x, y);
      if (const int i = label(x, y); i >= 0) {
        const Body& b = scene.bodies[static_cast<std::size_t>(i)];
        const Vec3 p = ray * meet(b, ray).z;
        const double step = 1e-4 * b.radius, along = (b.distance(p * (1 + step / p.norm())) - b.distance(p)) / step;
        if (std::abs(along) < least_facing) continue;
        scene.visible[static_cast<std::size_t>(i)].push_back(p);
      }
      const double n = noise[static_cast<std::size_t>(y) * o.width + x];
      scan.z_mm(x, y) = static_cast<float>(z(x, y) + o.sigma_mm * n);
    }
  return scene;
}

/// What no unbiased estimate of a body from its visible pixels can better: sd of the axis [rad], over both tilts, and
/// of the place across it (sphere: of the centre) [mm], all parameters free. Noise that is correlated over c px counts
/// as white noise of sd sqrt(4 pi) c times as large.
struct Bound {
  Vec3 center = Vec3::Zero();  ///< of the visible pixels: where the place is bounded
  double axis = 0;
  double place = 0;
};

inline Bound cramer_rao_bound(const Body& body, const std::vector<Vec3>& pixels, double sigma_mm,
                              double correlation_px) {
  Bound bound;
  for (const Vec3& p : pixels) bound.center += p / static_cast<double>(pixels.size());
  // Referred to the middle of what is seen.
  Body at = body;
  const bool sphere = body.type == PrimitiveType::sphere;
  if (!sphere) {
    const double t = body.axis.dot(bound.center - body.point);
    at.point += body.axis * t;
    at.radius += t * std::tan(body.half_angle);
  }
  Vec3 u, v;
  orthonormal_basis(at.axis, u, v);
  const auto moved = [&](int k, double step) {
    Body b = at;
    if (k < 2 && !sphere) b.axis = rotation_from_vector((k == 0 ? u : v) * step) * b.axis;
    if (k < 3 && sphere) b.point[k] += step;
    if ((k == 2 || k == 3) && !sphere) b.point += (k == 2 ? u : v) * step;
    if (k == 4) b.radius += step;
    if (k == 5) b.half_angle += step;
    return b;
  };
  const int count = sphere ? 4 : body.type == PrimitiveType::cone ? 6 : 5;
  const auto place = [&](int i) { return sphere && i == 3 ? 4 : i; };
  std::vector<std::array<Body, 2>> ends;
  const double step = 1e-5;
  for (int i = 0; i < count; ++i) ends.push_back({moved(place(i), -step), moved(place(i), step)});
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(count, count);
  const double variance = sigma_mm * sigma_mm * std::max(1.0, 4 * kPi * correlation_px * correlation_px);
  Eigen::VectorXd row(count);
  for (const Vec3& p : pixels) {
    const double along = (at.distance(p * (1 + step)) - at.distance(p * (1 - step))) / (2 * step * p.z());
    for (int i = 0; i < count; ++i)
      row[i] = (ends[static_cast<std::size_t>(i)][1].distance(p) - ends[static_cast<std::size_t>(i)][0].distance(p)) /
               (2 * step);
    h += row * row.transpose() / (variance * along * along);
  }
  const Eigen::MatrixXd c = h.ldlt().solve(Eigen::MatrixXd::Identity(count, count));
  bound.axis = sphere ? 0 : std::sqrt(c(0, 0) + c(1, 1));
  bound.place = sphere ? std::sqrt(c(0, 0) + c(1, 1) + c(2, 2)) : std::sqrt(c(2, 2) + c(3, 3));
  return bound;
}

/// Whether a primitive is the body: type, axis within 3 deg, place within 2 mm where it is seen, size within 10 % and
/// 2 mm; and by how much it is off.
struct Difference {
  double axis = 0;   ///< rad
  double place = 0;  ///< mm, across the axis at `center`
};

inline std::optional<Difference> difference(const Primitive& p, const Body& b, const Vec3& center) {
  if (p.type != b.type) return std::nullopt;
  Difference d;
  if (b.type == PrimitiveType::sphere) {
    d.place = (p.point - b.point).norm();
    if (d.place > 2 || std::abs(p.radius_mm - b.radius) > 2) return std::nullopt;
    return d;
  }
  d.axis = std::acos(std::min(1.0, std::abs(p.axis.dot(b.axis))));
  const Vec3 ours = p.point + p.axis * p.axis.dot(center - p.point);
  const Vec3 truth = b.point + b.axis * b.axis.dot(center - b.point);
  const Vec3 q = ours - truth;
  d.place = (q - b.axis * b.axis.dot(q)).norm();
  if (d.axis > 3 * kDegree || d.place > 2) return std::nullopt;
  if (b.type == PrimitiveType::cylinder && std::abs(p.radius_mm - b.radius) > std::min(2.0, 0.1 * b.radius))
    return std::nullopt;
  if (b.type == PrimitiveType::cone && std::abs(p.half_angle - b.half_angle) > 3 * kDegree) return std::nullopt;
  return d;
}

}  // namespace tribin::test
