#include "tribin/pose/look_up.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace tribin {
namespace {

// Normals of a scan's cell and of a facet that are the same surface differ by noise, by curvature across the cell and
// by the coarse pose: 40 deg keeps them and refuses the neighbouring face of a box.
constexpr float kNormalAgrees = 0.75f;

/// A rotation and translation in floats, for the inner loops.
struct FastPose {
  float r[9], t[3];
  explicit FastPose(const Pose& p) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) r[3 * i + j] = static_cast<float>(p.linear()(i, j));
      t[i] = static_cast<float>(p.translation()[i]);
    }
  }
  Vec3f turn(const Vec3f& n) const {
    return {r[0] * n[0] + r[1] * n[1] + r[2] * n[2], r[3] * n[0] + r[4] * n[1] + r[5] * n[2],
            r[6] * n[0] + r[7] * n[1] + r[8] * n[2]};
  }
  Vec3f move(const Vec3f& p) const {
    return {r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + t[0], r[3] * p[0] + r[4] * p[1] + r[5] * p[2] + t[1],
            r[6] * p[0] + r[7] * p[1] + r[8] * p[2] + t[2]};
  }
};

/// Where a point falls in the image.
struct Pixel {
  int u = 0, v = 0;
  bool inside = false;
};

Pixel project(const SceneDepth& scene, const Vec3f& q) {
  Pixel p;
  if (q[2] <= 1.f) return p;
  const float w = 1.f / q[2];
  const float x = static_cast<float>(scene.camera.fx) * q[0] * w + static_cast<float>(scene.camera.cx) + 0.5f;
  const float y = static_cast<float>(scene.camera.fy) * q[1] * w + static_cast<float>(scene.camera.cy) + 0.5f;
  if (x < 0 || y < 0 || x >= static_cast<float>(scene.z_mm.width) || y >= static_cast<float>(scene.z_mm.height))
    return p;
  p.u = static_cast<int>(x);
  p.v = static_cast<int>(y);
  p.inside = true;
  return p;
}

void look(const SceneDepth& scene, const FastPose& pose, const Vec3f& point, const Vec3f& normal, float tolerance,
          LookUp& out) {
  ++out.total;
  const Vec3f q = pose.move(point);
  const Pixel p = project(scene, q);
  if (!p.inside) {
    ++out.no_data;
    return;
  }
  const float z = scene.z_mm(p.u, p.v);
  if (!(z > 0)) {
    ++out.no_data;
    return;
  }
  const Vec3f n = pose.turn(normal);
  const float along = (n[0] * q[0] + n[1] * q[1] + n[2] * q[2]) / q[2];  // n . ray
  // A grazing facet says little about depth: no steeper than 72 deg counts.
  const float r = (z - q[2]) * std::max(std::abs(along), 0.3f);
  if (r > tolerance) {
    // On a step that is drawn out nothing is looked through.
    ++(scene.mixed.contains(p.u, p.v) && scene.mixed(p.u, p.v) ? out.no_data : out.violated);
  } else if (r < -tolerance) {
    ++out.occluded;
  } else if (scene.is_background(p.u, p.v)) {
    ++out.background;
  } else {
    const Vec3f m = scene.normal(p.u, p.v);
    const float agree = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
    if (agree > kNormalAgrees)
      ++out.supported;
    else if (m[0] == 0 && m[1] == 0 && m[2] == 0)
      ++out.unsure;
    // else: the right depth by chance; neither for nor against
  }
}

}  // namespace

LookUp look_up(const SceneDepth& scene, const Pose& camera_from_part, std::span<const Vec3f> points,
               std::span<const Vec3f> normals, std::size_t count, double tolerance_mm,
               std::span<const GiveUp> give_up) {
  LookUp out;
  const FastPose pose(camera_from_part);
  count = std::min(count, points.size());
  auto stop = give_up.begin();
  for (std::size_t i = 0; i < count; ++i) {
    if (stop != give_up.end() && i == stop->after) {
      if (out.score() < stop->below) return out;
      ++stop;
    }
    look(scene, pose, points[i], normals[i], static_cast<float>(tolerance_mm), out);
  }
  return out;
}

Pose refine_points(const SceneDepth& scene, const Pose& start, std::span<const Vec3f> points,
                   std::span<const Vec3f> normals, std::size_t count, const PointRefineOptions& options) {
  Pose pose = start;
  count = std::min(count, points.size());
  const double ratio =
      std::pow(options.end_tolerance_mm / options.start_tolerance_mm, 1.0 / std::max(1, options.iterations - 1));
  double tolerance = options.start_tolerance_mm;
  for (int it = 0; it < options.iterations; ++it, tolerance *= ratio) {
    const FastPose fast(pose);
    const Eigen::Vector3f c = (pose * Eigen::Vector3d(options.center)).cast<float>();
    std::array<double, 21> h{};
    std::array<double, 6> b{};
    int used = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f q = fast.move(points[i]);
      const Pixel p = project(scene, q);
      if (!p.inside) continue;
      const float z = scene.z_mm(p.u, p.v);
      if (!(z > 0)) continue;
      const Vec3f n = fast.turn(normals[i]);
      const Vec3f m = scene.normal(p.u, p.v);
      if (m[0] * n[0] + m[1] * n[1] + m[2] * n[2] < 0.5f) continue;
      const float s = z / q[2];
      const Vec3f d(q[0] * s - q[0], q[1] * s - q[1], z - q[2]);  // along the ray through the point
      const double r = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
      if (std::abs(r) > tolerance) continue;
      const double g = 1 - r * r / (tolerance * tolerance);
      const double w = g * g;  // Tukey's biweight
      const float px = q[0] - c[0], py = q[1] - c[1], pz = q[2] - c[2];
      const std::array<double, 6> jac = {
          n[0], n[1], n[2], py * n[2] - pz * n[1], pz * n[0] - px * n[2], px * n[1] - py * n[0]};
      std::size_t k = 0;
      for (std::size_t a = 0; a < 6; ++a) {
        b[a] += w * jac[a] * r;
        for (std::size_t e = a; e < 6; ++e) h[k++] += w * jac[a] * jac[e];
      }
      ++used;
    }
    if (used < 8) return pose;
    Eigen::Matrix<double, 6, 6> hm;
    Eigen::Matrix<double, 6, 1> bm;
    std::size_t k = 0;
    const double lever = options.lever_mm;
    for (int a = 0; a < 6; ++a) {
      const double sa = a < 3 ? 1 : 1 / lever;
      bm[a] = sa * b[static_cast<std::size_t>(a)];
      for (int e = a; e < 6; ++e) hm(a, e) = hm(e, a) = sa * (e < 3 ? 1 : 1 / lever) * h[k++];
    }
    // Levenberg's damping keeps the directions that these few points do not hold.
    hm.diagonal().array() += 0.01 * hm.trace() / 6;
    const Eigen::Matrix<double, 6, 1> x = hm.ldlt().solve(bm);
    Vector6 delta;
    delta << x[0], x[1], x[2], x[3] / lever, x[4] / lever, x[5] / lever;
    pose = moved_about(pose, pose * options.center, delta);
  }
  // Rounding of repeated products: back to a rotation.
  Eigen::Quaterniond q{Eigen::Matrix3d(pose.linear())};
  pose.linear() = q.normalized().toRotationMatrix();
  return pose;
}

}  // namespace tribin
