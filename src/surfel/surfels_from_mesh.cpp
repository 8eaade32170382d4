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

/// Whether so many lines bound a patch that it is no facet of anything round: those lie between two rulings and two
/// chords. \param rim  the patch's rim edges, longest first.
bool has_many_sides(const Mesh& mesh, const std::vector<const MeshEdge*>& rim, double sigma) {
  constexpr std::size_t kSides = 5;
  struct Line {
    Vec3 point, direction;
    double length;
  };
  std::vector<Line> lines;
  for (const MeshEdge* e : rim) {
    const Vec3 ends[] = {mesh.vertices[e->v0].cast<double>(), mesh.vertices[e->v1].cast<double>()};
    const bool known = std::any_of(lines.begin(), lines.end(), [&](const Line& line) {
      return std::all_of(std::begin(ends), std::end(ends), [&](const Vec3& p) {
        const Vec3 q = p - line.point;
        return q.cross(line.direction).norm() < 4.0 * sigma * (1.0 + q.norm() / line.length);
      });
    });
    const double length = (ends[1] - ends[0]).norm();
    if (known || !(length > 8.0 * sigma)) continue;
    if (lines.size() + 1 >= kSides) return true;
    lines.push_back({ends[0], (ends[1] - ends[0]) / length, length});
  }
  return false;
}

/// Patches that are planes for their outline alone.
std::vector<std::uint8_t> outlined_planes(const Mesh& mesh, const MeshPatches& p, double sigma) {
  std::vector<std::vector<const MeshEdge*>> rim(p.patch_area.size());
  for (const MeshEdge& e : p.edges)
    if (p.patch[e.a] != p.patch[e.b])
      for (std::uint32_t t : {e.a, e.b}) rim[p.patch[t]].push_back(&e);
  std::vector<std::uint8_t> out(rim.size());
  for (std::size_t k = 0; k < rim.size(); ++k) {
    std::stable_sort(rim[k].begin(), rim[k].end(),
                     [](const MeshEdge* a, const MeshEdge* b) { return a->length > b->length; });
    out[k] = has_many_sides(mesh, rim[k], sigma);
  }
  return out;
}

/// A patch may be a plane when less than 30 % of its rim goes on smoothly, unless it goes on to its like on two sides
/// as the facets of a narrow band do; or when it is far wider than the strips beside it. \source algorithms.md section
/// 15, CAD side; the band is ours.
bool may_be_plane(const MeshPatches& p, const Bend& bend, std::size_t k) {
  if (p.patch_smooth_rim[k] < 0.3 * p.patch_rim[k] && bend.alike < 2) return true;
  return p.patch_width[k] > 2.5 * bend.neighbour_width;
}

/// Whether all coordinates are multiples of `step`, up to float.
bool on_grid(const Mesh& mesh, double step) {
  for (const Vec3f& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) {
      const double x = v[k];
      if (std::abs(x - step * std::round(x / step)) > 2e-7 * std::abs(x)) return false;
    }
  return true;
}

/// How far vertices lie off the surface that they were put on [mm, sd]: the writer's last decimal where one shows, else
/// what float and CAD kernels leave.
double rounding_mm(const Mesh& mesh) {
  Vec3f low = mesh.vertices[mesh.triangles[0][0]], high = low;
  for (const Vec3f& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const double diagonal = (high - low).norm();
  // Six or seven digits; kernels let faces and their edges part by about half a micrometre.
  const double least = std::max(std::min(5e-4, 1e-5 * diagonal), 3e-6 * diagonal);
  // A coarser grid than 1e-4 of the part is that of its design: boxes have round coordinates.
  for (double step = 1; step > least; step /= 10) {
    if (step > 1e-4 * diagonal) continue;
    for (double unit : {1.0, 25.4})  // a decimal of a millimetre or of an inch
      if (unit * step <= 1e-4 * diagonal && on_grid(mesh, unit * step))
        return std::max(least, unit * step / std::sqrt(12.0));
  }
  return least;
}

}  // namespace

Surfels surfels_from_mesh(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  if (count == 0) throw Error(ErrorCode::too_little_data, mesh.name + ": the mesh has no triangle");
  const MeshPatches p = find_patches(mesh);
  const std::vector<Bend> bends = bends_of(p);

  const float rounding = static_cast<float>(rounding_mm(mesh));

  const std::vector<std::uint8_t> outlined = outlined_planes(mesh, p, rounding);

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
    if (bend.weight == 0) continue;
    if (may_be_plane(p, bend, k)) {
      if (outlined[k]) continue;
      s.shape[t] = SurfelShape::unknown;
      continue;
    }
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
