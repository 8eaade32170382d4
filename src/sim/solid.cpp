#include "sim/solid.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "sim/convex_hull.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"
#include "tribin/sim/stable_rests.hpp"

namespace tribin::sim {
namespace {

/// Second moments of the solid about a point, per volume: integral of x x^T.
/// \source tetrahedra from the point: V / 20 (sum p_i p_i^T + s s^T), s the sum of the corners.
Matrix3 second_moments(const Mesh& mesh, const Vec3& about) {
  Matrix3 sum = Matrix3::Zero();
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>() - about, b = mesh.vertices[t[1]].cast<double>() - about,
               c = mesh.vertices[t[2]].cast<double>() - about;
    const double v = a.dot(b.cross(c)) / 6;
    const Vec3 s = a + b + c;
    volume += v;
    sum += v / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  return sum / volume;
}

double hull_volume(const Mesh& mesh) {
  std::vector<Vec3> points;
  for (const Vec3f& v : mesh.vertices) points.push_back(v.cast<double>());
  double volume = 0;
  const Vec3 inside = bounding_box(mesh.vertices).center();
  for (const std::vector<int>& face : convex_hull(points))
    for (std::size_t i = 1; i + 1 < face.size(); ++i)
      volume +=
          std::abs((points[face[0]] - inside).dot((points[face[i]] - inside).cross(points[face[i + 1]] - inside))) / 6;
  return volume;
}

}  // namespace

Solid::Solid(const Mesh& mesh) {
  const Vec3 centre = centre_of_mass(mesh);
  state_ = std::make_unique<State>(mesh);
  const Matrix3 moments = second_moments(mesh, centre);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(moments)};
  Matrix3 axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  state_->part_from_body.linear() = axes;
  state_->part_from_body.translation() = centre;
  const Eigen::Vector3d m = solver.eigenvalues().cwiseMax(0);
  state_->inertia_per_mass = Vec3(m[1] + m[2], m[0] + m[2], m[0] + m[1]);
  state_->hull_volume = hull_volume(mesh);
  state_->diameter = tribin::diameter(mesh.vertices);
}

Solid::~Solid() = default;
Solid::Solid(Solid&&) noexcept = default;
Solid& Solid::operator=(Solid&&) noexcept = default;
const Mesh& Solid::mesh() const { return *state_->mesh; }
double Solid::hull_volume_mm3() const { return state_->hull_volume; }
double Solid::diameter_mm() const { return state_->diameter; }

namespace {

/// How deep points on the surface of `a` lie in `b`.
double depth_in(const Solid::State& a, const Solid::State& b, const Pose& b_from_a) {
  const Box box = bounding_box(b.mesh->vertices);
  const double spacing = a.diameter / 200;
  double deepest = 0;
  const auto probe = [&](const Vec3& point) {
    const Vec3 p = b_from_a * point;
    if (!((p - box.min).minCoeff() > deepest && (box.max - p).minCoeff() > deepest)) return;
    // The field is right within a quarter of its cells: only what it does not clear is measured on the triangles.
    if (b.field.at(p.cast<float>()) > b.field.cell_mm() / 2) return;
    deepest = std::max(deepest, -b.exact.signed_distance(p));
  };
  for (const auto& t : a.mesh->triangles) {
    const Vec3 o = a.mesh->vertices[t[0]].cast<double>(), u = a.mesh->vertices[t[1]].cast<double>() - o,
               w = a.mesh->vertices[t[2]].cast<double>() - o;
    // A triangle whose circle about its middle is clear of b cannot lie in it.
    const Vec3 middle = o + (u + w) / 3;
    const double reach = std::max({(o - middle).norm(), (o + u - middle).norm(), (o + w - middle).norm()});
    if (b.field.lower_bound((b_from_a * middle).cast<float>()) > reach) continue;
    const int n = std::max(1, static_cast<int>(std::ceil(std::max({u.norm(), w.norm(), (u - w).norm()}) / spacing)));
    for (int i = 0; i <= n; ++i)
      for (int k = 0; i + k <= n; ++k) probe(o + u * i / n + w * k / n);
  }
  return deepest;
}

}  // namespace

double overlap_mm(const Solid& a, const Pose& world_from_a, const Solid& b, const Pose& world_from_b) {
  const Pose b_from_a = world_from_b.inverse() * world_from_a;
  return std::max(depth_in(a.state(), b.state(), b_from_a), depth_in(b.state(), a.state(), b_from_a.inverse()));
}

}  // namespace tribin::sim
