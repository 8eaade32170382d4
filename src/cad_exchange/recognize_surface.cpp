#include "cad_exchange/recognize_surface.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

namespace tribin::detail {
namespace {

double extent(const std::vector<SurfacePoint>& points) {
  Vec3 low = points[0].position, high = low;
  for (const SurfacePoint& s : points) {
    low = low.cwiseMin(s.position);
    high = high.cwiseMax(s.position);
  }
  return (high - low).norm();
}

template <class Distance>
bool all_within(const std::vector<SurfacePoint>& points, double tolerance, const Distance& distance) {
  return std::all_of(points.begin(), points.end(),
                     [&](const SurfacePoint& s) { return std::abs(distance(s.position)) <= tolerance; });
}

std::optional<CadFace> as_plane(const std::vector<SurfacePoint>& points, double tolerance) {
  CadFace f;
  f.type = SurfaceType::plane;
  f.point = points[points.size() / 2].position;
  Vec3 sum = Vec3::Zero();
  for (const SurfacePoint& s : points) sum += s.normal;
  if (sum.norm() < 0.5 * static_cast<double>(points.size())) return {};
  f.axis = sum.normalized();
  if (!all_within(points, tolerance, [&](const Vec3& p) { return f.axis.dot(p - f.point); })) return {};
  return f;
}

/// c and R of p = c + R n, both across `axis` (a zero axis: in space).
void centre_and_radius(const std::vector<SurfacePoint>& points, const Vec3& axis, Vec3& centre, double& radius) {
  const Matrix3 across = Matrix3::Identity() - axis * axis.transpose();
  Vec3 mean_p = Vec3::Zero(), mean_n = Vec3::Zero();
  for (const SurfacePoint& s : points) {
    mean_p += across * s.position;
    mean_n += across * s.normal;
  }
  mean_p /= static_cast<double>(points.size());
  mean_n /= static_cast<double>(points.size());
  double pn = 0, nn = 0;
  for (const SurfacePoint& s : points) {
    const Vec3 n = across * s.normal - mean_n;
    pn += n.dot(across * s.position - mean_p);
    nn += n.dot(n);
  }
  radius = nn > 0 ? pn / nn : 0;
  centre = mean_p - radius * mean_n;
}

std::optional<CadFace> as_sphere(const std::vector<SurfacePoint>& points, double tolerance) {
  CadFace f;
  f.type = SurfaceType::sphere;
  double radius = 0;
  centre_and_radius(points, Vec3::Zero(), f.point, radius);
  f.radius_mm = std::abs(radius);
  if (!all_within(points, tolerance, [&](const Vec3& p) { return (p - f.point).norm() - f.radius_mm; })) return {};
  return f;
}

std::optional<CadFace> as_cylinder(const std::vector<SurfacePoint>& points, const Vec3& axis, double tolerance) {
  CadFace f;
  f.type = SurfaceType::cylinder;
  f.axis = axis;
  double radius = 0;
  centre_and_radius(points, axis, f.point, radius);
  f.radius_mm = std::abs(radius);
  const auto distance = [&](const Vec3& p) {
    const Vec3 d = p - f.point;
    return (d - d.dot(axis) * axis).norm() - f.radius_mm;
  };
  if (!all_within(points, tolerance, distance)) return {};
  return f;
}

std::optional<CadFace> as_cone(const std::vector<SurfacePoint>& points, Vec3 axis, double normal_dot,
                               double tolerance) {
  // Each tangent plane goes through the apex.
  Matrix3 a = Matrix3::Zero();
  Vec3 b = Vec3::Zero();
  for (const SurfacePoint& s : points) {
    a += s.normal * s.normal.transpose();
    b += s.normal * s.normal.dot(s.position);
  }
  CadFace f;
  f.type = SurfaceType::cone;
  f.point = Eigen::Matrix3d(a).ldlt().solve(Eigen::Vector3d(b));
  f.half_angle = std::asin(std::min(1.0, std::abs(normal_dot)));
  Vec3 middle = Vec3::Zero();
  for (const SurfacePoint& s : points) middle += s.position / static_cast<double>(points.size());
  f.axis = axis.dot(middle - f.point) < 0 ? Vec3(-axis) : axis;
  const auto distance = [&](const Vec3& p) {
    const Vec3 d = p - f.point;
    const double along = d.dot(f.axis);
    return (d - along * f.axis).norm() * std::cos(f.half_angle) - along * std::sin(f.half_angle);
  };
  if (!f.point.allFinite() || !all_within(points, tolerance, distance)) return {};
  return f;
}

}  // namespace

CadFace recognize_surface(const std::vector<SurfacePoint>& points, double tolerance) {
  CadFace free_form;
  if (points.size() < 12) return free_form;
  if (const auto f = as_plane(points, tolerance)) return *f;
  // A radius beyond this is not told from free form by a face of this size.
  const double largest_radius = 100 * extent(points);
  if (const auto f = as_sphere(points, tolerance); f && f->radius_mm < largest_radius) return *f;
  Vec3 mean = Vec3::Zero();
  for (const SurfacePoint& s : points) mean += s.normal / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const SurfacePoint& s : points) spread += (s.normal - mean) * (s.normal - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Vec3 axis = solver.eigenvectors().col(0);
  if (const auto f = as_cylinder(points, axis, tolerance); f && f->radius_mm < largest_radius) return *f;
  if (const auto f = as_cone(points, axis, mean.dot(axis), tolerance)) return *f;
  return free_form;
}

}  // namespace tribin::detail
