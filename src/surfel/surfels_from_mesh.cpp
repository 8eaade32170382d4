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
  Vec3 ruling_sum = Vec3::Zero();  ///< of +-ruling, weighted by the shared edge
  Matrix3 rulings = Matrix3::Zero();
  double curvature = 0, weight = 0;
  double neighbour_width = 0, dihedral = 0;
};

std::vector<Bend> bends_of(const Mesh& mesh, const MeshPatches& p) {
  std::vector<Bend> bends(p.patch_area.size());
  for (const MeshEdge& e : p.edges) {
    const std::uint32_t a = p.patch[e.a], b = p.patch[e.b];
    if (a == b || std::abs(e.dihedral) >= kSmooth) continue;
    const Vec3 ruling = (mesh.vertices[e.v1] - mesh.vertices[e.v0]).cast<double>().normalized();
    const double step = 0.5 * (p.patch_width[a] + p.patch_width[b]);  // between the mid-lines of two strips
    for (const auto& [own, other] : {std::pair{a, b}, std::pair{b, a}}) {
      Bend& bend = bends[own];
      bend.rulings += e.length * ruling * ruling.transpose();
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
      bend.rulings /= bend.weight;
    }
  return bends;
}

/// A patch is a plane when less than 30 % of its rim goes on smoothly, or when it is far wider than the strips beside
/// it. \source algorithms.md section 15, CAD side.
bool is_plane(const MeshPatches& p, const Bend& bend, std::size_t k) {
  if (bend.weight == 0 || p.patch_smooth_rim[k] < 0.3 * p.patch_rim[k]) return true;
  return p.patch_width[k] > 2.5 * bend.neighbour_width;
}

}  // namespace

Surfels surfels_from_mesh(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  if (count == 0) throw Error(ErrorCode::too_little_data, mesh.name + ": the mesh has no triangle");
  const MeshPatches p = find_patches(mesh);
  const std::vector<Bend> bends = bends_of(mesh, p);

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
    // The ruling: where the edges to the neighbours agree. On a sphere or a fillet's end they do not.
    double best = -1;
    Vec3 ruling = u;
    for (int i = 0; i < 3; ++i) {  // power iteration from the longest column: a 3 x 3 scatter of few directions
      if (bend.rulings.col(i).norm() > best)
        best = bend.rulings.col(i).norm(), ruling = bend.rulings.col(i).normalized();
    }
    for (int i = 0; i < 20; ++i) ruling = (bend.rulings * ruling).normalized();
    const double agreement = ruling.dot(bend.rulings * ruling);
    s.shape[t] = agreement > 0.9 ? SurfelShape::ruled : SurfelShape::curved;
    s.direction2[t] = ruling.cast<float>();
    s.curvature1[t] = static_cast<float>(bend.curvature);
    if (s.shape[t] == SurfelShape::curved) s.curvature2[t] = s.curvature1[t];
    // A facet's normal is off by up to half the angle between strips.
    s.sigma_normal[t] = static_cast<float>(std::max(1e-3, 0.5 * bend.dihedral));
  }

  // Neighbours: across edges where the surface goes on smoothly.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const MeshEdge& e : p.edges) {
    if (std::abs(e.dihedral) >= kSmooth) continue;
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
