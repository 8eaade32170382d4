#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "surfel/mesh_patches.hpp"
#include "tribin/core/error.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {
namespace {

using namespace surfel_detail;

/// What the strips beside a patch say about the curved surface that it may belong to.
struct Bend {
  Matrix3 turns = Matrix3::Zero();  ///< scatter of the directions in which the normal turns over its smooth edges
  double curvature = 0, weight = 0;
  double neighbour_width = 0, dihedral = 0;
  int alike = 0;  ///< smooth edges to patches of its width that turn as far as its others
};

/// Within the unevenness of a tessellation.
bool alike(double a, double b) { return a < 1.4 * b && b < 1.4 * a; }

std::vector<Bend> bends_of(const MeshPatches& p) {
  std::vector<Bend> bends(p.patch_area.size());
  for (const MeshEdge& e : p.edges) {
    const std::uint32_t a = p.patch[e.a], b = p.patch[e.b];
    if (a == b || std::abs(e.dihedral) >= kSmooth) continue;
    const double step = 0.5 * (p.patch_width[a] + p.patch_width[b]);  // between the mid-lines of two strips
    for (const auto& [own, other] : {std::pair{a, b}, std::pair{b, a}}) {
      Bend& bend = bends[own];
      bend.curvature += e.length * 2.0 * std::sin(0.5 * e.dihedral) / std::max(step, 1e-9);
      bend.neighbour_width += e.length * p.patch_width[other];
      bend.dihedral += e.length * std::abs(e.dihedral);
      bend.weight += e.length;
    }
  }
  for (Bend& bend : bends)
    if (bend.weight > 0) {
      bend.curvature /= bend.weight;
      bend.neighbour_width /= bend.weight;
      bend.dihedral /= bend.weight;
    }
  for (const MeshEdge& e : p.edges) {
    if (p.patch[e.a] == p.patch[e.b] || std::abs(e.dihedral) >= kSmooth) continue;
    const Vec3 turn = p.normal[e.b] - p.normal[e.a];
    const double square = turn.squaredNorm();
    const bool as_wide = alike(p.patch_width[p.patch[e.a]], p.patch_width[p.patch[e.b]]);
    for (Bend* bend : {&bends[p.patch[e.a]], &bends[p.patch[e.b]]}) {
      // By the length's square: a strip's long sides are its surface's, its short ends may be a fillet's. Turns count
      // alike but for small ones, whose direction is the facets' own error.
      const double usual = bend->dihedral * bend->dihedral;
      bend->alike += as_wide && alike(std::abs(e.dihedral), bend->dihedral);
      if (usual > 0) bend->turns += e.length * e.length / (square + usual) * turn * turn.transpose();
    }
  }
  return bends;
}

/// A patch is a plane when less than 30 % of its rim goes on smoothly, unless it goes on to its like on two sides as
/// the facets of a narrow band do; or when it is far wider than the strips beside it. \source algorithms.md section 15,
/// CAD side; the band is ours.
bool is_plane(const MeshPatches& p, const Bend& bend, std::size_t k) {
  if (bend.weight == 0) return true;
  if (p.patch_smooth_rim[k] < 0.3 * p.patch_rim[k] && bend.alike < 2) return true;
  return p.patch_width[k] > 2.5 * bend.neighbour_width;
}

}  // namespace

Surfels surfels_from_mesh(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  if (count == 0) throw Error(ErrorCode::too_little_data, mesh.name + ": the mesh has no triangle");
  const MeshPatches p = find_patches(mesh);
  const std::vector<Bend> bends = bends_of(p);

  Vec3f low = mesh.vertices[mesh.triangles[0][0]], high = low;
  for (const Vec3f& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  // Vertices sit on the surface up to the rounding of the file: six or seven digits, or thousandths of a millimetre.
  const float rounding = std::max(5e-4f, 3e-6f * (high - low).norm());

  Surfels s;
  s.mesh = &mesh;
  s.position.resize(count);
  s.normal.resize(count);
  s.curvature1.assign(count, 0.0f);
  s.curvature2.assign(count, 0.0f);
  s.direction2.resize(count);
  s.sigma_curvature.assign(count, 1e-6f);
  s.sigma_normal.assign(count, 1e-3f);
  s.sigma_mm.assign(count, rounding);
  s.area_mm2.resize(count);
  s.shape.assign(count, SurfelShape::flat);
  s.points.assign(count, 1);
  for (std::size_t t = 0; t < count; ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    s.position[t] = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0f;
    s.normal[t] = p.normal[t].cast<float>();
    s.area_mm2[t] = static_cast<float>(p.area[t]);
    const std::size_t k = p.patch[t];
    const Bend& bend = bends[k];
    Vec3 u, v;
    orthonormal_basis(p.normal[t], u, v);
    s.direction2[t] = u.cast<float>();
    if (is_plane(p, bend, k)) continue;
    // A surface is ruled where its normal turns one way only: across the ruling. (The edges between facets are the
    // rulings where facets are long, but zigzag on a narrow band of a cone.) Exactly one way gives 1, a ball 1/2.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(bend.turns)};
    const Vec3 across = Vec3(solver.eigenvectors().col(2)), ruling = p.normal[t].cross(across).normalized();
    const bool ruled = solver.eigenvalues()[2] > 0.75 * solver.eigenvalues().sum();
    s.shape[t] = ruled ? SurfelShape::ruled : SurfelShape::curved;
    s.direction2[t] = ruling.cast<float>();
    s.curvature1[t] = static_cast<float>(bend.curvature);
    if (!ruled) s.curvature2[t] = s.curvature1[t];
    // A facet's normal is off by up to half the angle between strips.
    s.sigma_normal[t] = static_cast<float>(std::max(1e-3, 0.5 * bend.dihedral));
  }

  // Neighbours: across edges where the surface goes on smoothly.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const MeshEdge& e : p.edges) {
    if (std::abs(e.dihedral) >= kSmooth) continue;
    // Rulings that cross are those of two surfaces that are tangent: a cylinder and its fillet.
    if (s.shape[e.a] == SurfelShape::ruled && s.shape[e.b] == SurfelShape::ruled &&
        std::abs(s.direction2[e.a].dot(s.direction2[e.b])) < 0.7f)
      continue;
    pairs.emplace_back(e.a, e.b);
    pairs.emplace_back(e.b, e.a);
  }
  std::sort(pairs.begin(), pairs.end());
  s.neighbour_begin.assign(count + 1, 0);
  for (const auto& [a, b] : pairs) ++s.neighbour_begin[a + 1];
  for (std::size_t i = 0; i < count; ++i) s.neighbour_begin[i + 1] += s.neighbour_begin[i];
  s.neighbours.reserve(pairs.size());
  for (const auto& [a, b] : pairs) s.neighbours.push_back(b);
  return s;
}

}  // namespace tribin
