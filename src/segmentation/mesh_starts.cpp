#include "segmentation/mesh_starts.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tribin::segmentation_detail {
namespace {

/// The axis across the normals' great circle.
Vec3 across_normals(const Surfels& s, const Indices& near) {
  Matrix3 scatter = Matrix3::Zero();
  for (std::uint32_t i : near) {
    const Vec3 n = s.normal[i].cast<double>();
    scatter += s.area_mm2[i] * n * n.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(scatter)};
  return solver.eigenvectors().col(0);
}

/// The tighter principal curvature of facets about the first of them [1/mm], signed: how the normals turn over the way
/// between the facets' centres, least squares of a symmetric matrix.
double tighter_curvature(const Surfels& s, const Indices& near) {
  Vec3 u, v;
  orthonormal_basis(s.normal[near[0]].cast<double>(), u, v);
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::uint32_t i : near) {
    const Vec3 d = (s.position[i] - s.position[near[0]]).cast<double>();
    const Vec3 n = (s.normal[i] - s.normal[near[0]]).cast<double>();
    const double x = d.dot(u), y = d.dot(v), length = d.squaredNorm();
    if (length <= 0) continue;
    const Eigen::Vector3d rows[] = {{x, y, 0}, {0, x, y}};
    const double turns[] = {n.dot(u), n.dot(v)};
    for (int k = 0; k < 2; ++k) {
      a += rows[k] * rows[k].transpose() / length;
      b += rows[k] * turns[k] / length;
    }
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(a);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 1e-6 * a.trace())) return 0;
  const Eigen::Vector3d c = solver.solve(b);
  const double middle = 0.5 * (c[0] + c[2]), half = std::hypot(0.5 * (c[0] - c[2]), c[1]);
  return middle >= 0 ? middle + half : middle - half;
}

/// Tori from the axis that all normals of a surface of revolution meet, and the circle that the corners then draw in
/// the half plane of (distance from the axis, place along it). A line with direction a and moment m meets the normal n
/// at p where n.m + (p x n).a = 0: linear in both. \source Pottmann and Wallner, Computational Line Geometry, ch. 3.
/// The normals of a piece of a torus nearly meet the tangent of its tube's circle as well: then circle and axis are to
/// be exchanged. Which of the two it was the fits say.
void add_tori_from_lines(const Surfels& s, const Indices& near, std::vector<Surface>& all) {
  const Vec3 origin = s.position[near[0]].cast<double>();
  Eigen::Matrix3d mm = Eigen::Matrix3d::Zero(), ma = mm, aa = mm;
  for (std::uint32_t i : near) {
    const Eigen::Vector3d n = s.normal[i].cast<double>(),
                          l = (s.position[i].cast<double>() - origin).cross(s.normal[i].cast<double>());
    mm += s.area_mm2[i] * n * n.transpose();
    ma += s.area_mm2[i] * n * l.transpose();
    aa += s.area_mm2[i] * l * l.transpose();
  }
  const Eigen::LDLT<Eigen::Matrix3d> moments(mm);
  if (moments.info() != Eigen::Success || !(moments.vectorD().minCoeff() > 1e-9 * mm.trace())) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(aa - ma.transpose() * moments.solve(ma));
  const Eigen::Vector3d a = solver.eigenvectors().col(0), m = -moments.solve(ma * a);
  const Vec3 axis = Vec3(a);
  const Vec3 foot = Vec3(a.cross(m));
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  Vec3 p[3];
  const auto place = [&](const Vec3& x) {
    const Vec3 q = x - origin - foot;
    const double t = q.dot(axis);
    return Eigen::Vector2d((q - axis * t).norm(), t);
  };
  const Eigen::Vector2d first = place(origin);  // moments about a place nearby keep their digits
  for (std::uint32_t i : near) {
    raw_points(s, i, p);
    for (const Vec3& x : p) {
      const Eigen::Vector2d d = place(x) - first;
      const Eigen::Vector3d row(d.x(), d.y(), 1);
      h += row * row.transpose();
      g += row * d.squaredNorm();
    }
  }
  const Eigen::LDLT<Eigen::Matrix3d> circle(h);
  if (circle.info() != Eigen::Success || !(circle.vectorD().minCoeff() > 0)) return;
  const Eigen::Vector3d c = circle.solve(g);
  const double square = c[2] + 0.25 * (c[0] * c[0] + c[1] * c[1]);
  if (!(square > 0)) return;
  const Eigen::Vector2d centre = first + 0.5 * c.head<2>();
  Surface out;
  out.type = PrimitiveType::torus;
  const auto add = [&](const Vec3& about, const Vec3& point, double radius, double minor) {
    if (!(minor > 0) || minor >= radius) return;
    out.axis = about, out.point = point, out.radius = radius, out.minor_radius = minor, out.concave = false;
    double outward = 0;
    for (std::uint32_t i : near) outward += out.normal(s.position[i].cast<double>()).dot(s.normal[i].cast<double>());
    out.concave = outward < 0;
    all.push_back(out);
  };
  const Vec3 middle = origin + foot + axis * centre.y();
  add(axis, middle, centre.x(), std::sqrt(square));
  Vec3 radial = -foot - axis * axis.dot(-foot);
  if (!(radial.norm() > 0)) return;
  radial.normalize();
  add(axis.cross(radial), middle + radial * centre.x(), std::abs(centre.x()),
      std::abs(std::abs(centre.x()) - std::sqrt(square)));
}

}  // namespace

double common_edge_mm(const Surfels& s, std::uint32_t i, std::uint32_t j) {
  Vec3f ends[3];
  int count = 0;
  for (std::uint32_t a : s.mesh->triangles[i])
    for (std::uint32_t b : s.mesh->triangles[j])
      if (a == b && count < 3) ends[count++] = s.mesh->vertices[a];
  return count >= 2 ? static_cast<double>((ends[0] - ends[1]).norm()) : 0.0;
}

bool is_ring(const Surfels& s, const Indices& support) {
  Vec3 mean = Vec3::Zero();
  Matrix3 second = Matrix3::Zero();
  double noise = 0;
  for (std::uint32_t i : support) {
    const Vec3 n = s.normal[i].cast<double>();
    mean += n / static_cast<double>(support.size());
    second += n * n.transpose() / static_cast<double>(support.size());
    noise += s.sigma_normal[i] / static_cast<double>(support.size());
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(second - mean * mean.transpose())};
  return std::sqrt(std::max(0.0, solver.eigenvalues()[0])) < 0.5 * noise;
}

Surface cone_from_fan(const Surfels& s, const Indices& fan) {
  Surface out;
  out.type = PrimitiveType::cone;
  const auto& triangles = s.mesh->triangles;
  const auto has = [&](std::uint32_t i, std::uint32_t v) {
    return std::find(triangles[i].begin(), triangles[i].end(), v) != triangles[i].end();
  };
  const auto shared = std::find_if(triangles[fan[0]].begin(), triangles[fan[0]].end(), [&](std::uint32_t v) {
    return std::all_of(fan.begin(), fan.end(), [&](std::uint32_t i) { return has(i, v); });
  });
  if (shared == triangles[fan[0]].end()) return out;
  const Vec3 apex = s.mesh->vertices[*shared].cast<double>();
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double facing = 0, length = 0, count = 0;
  for (std::uint32_t i : fan)
    for (std::uint32_t v : triangles[i]) {
      if (v == *shared) continue;
      const Eigen::Vector3d to = s.mesh->vertices[v].cast<double>() - apex, d = to.normalized();
      a += d * d.transpose();
      b += d;
      length += to.norm();
      ++count;
    }
  const Eigen::LDLT<Eigen::Matrix3d> solver(a);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 1e-9 * count)) return out;
  const Eigen::Vector3d x = solver.solve(b);
  if (!(x.norm() > 1)) return out;
  out.axis = Vec3(x.normalized());
  out.half_angle = std::acos(1.0 / x.norm());
  const double slant = 0.5 * length / count;  // refer the radius to the middle of the fan
  out.point = apex + out.axis * (slant * std::cos(out.half_angle));
  out.radius = slant * std::sin(out.half_angle);
  for (std::uint32_t i : fan) facing += out.normal(s.position[i].cast<double>()).dot(s.normal[i].cast<double>());
  out.concave = facing < 0;
  return out;
}

std::vector<Surface> starts_on_mesh(const Surfels& s, const Indices& near) {
  std::vector<Surface> out;
  out.push_back(cylinder_from_normals(s, near, across_normals(s, near)));
  out.push_back(cone_from_normals(s, near));
  out.push_back(sphere_from_normals(s, near));
  const double curvature = tighter_curvature(s, near);
  if (curvature != 0) out.push_back(torus_of_tube(s, near, 1.0 / curvature));
  add_tori_from_lines(s, near, out);
  return out;
}

}  // namespace tribin::segmentation_detail
