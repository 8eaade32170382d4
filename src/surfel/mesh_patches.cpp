#include "surfel/mesh_patches.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tribin/cad/half_edges.hpp"

namespace tribin::surfel_detail {
namespace {

// Normals of skinny triangles carry the rounding of float vertices; 0.1 deg is 30 times it for triangles 0.05 mm high
// and far below the 2 deg of the finest tessellation.
constexpr double kCoplanar = 0.1 * kDegree;

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

std::vector<MeshEdge> find_edges(const Mesh& mesh, const std::vector<Vec3>& normal) {
  std::vector<MeshEdge> edges;
  for_each_edge(sorted_half_edges(mesh.triangles), [&](std::span<const HalfEdge> half) {
    if (half.size() != 2) return;  // edges of one or of three triangles join nothing
    const std::uint32_t a = half[0].triangle, b = half[1].triangle;
    const Vec3 v0 = mesh.vertices[half[0].low].cast<double>(), v1 = mesh.vertices[half[0].high].cast<double>();
    const Vec3 along = half[0].forward ? Vec3(v1 - v0) : Vec3(v0 - v1);  // as triangle a runs
    const Vec3 cross = normal[a].cross(normal[b]);
    const double angle = std::atan2(cross.norm(), normal[a].dot(normal[b]));
    edges.push_back({a, b, half[0].low, half[0].high, static_cast<float>(cross.dot(along) >= 0 ? angle : -angle),
                     static_cast<float>(along.norm())});
  });
  return edges;
}

}  // namespace

MeshPatches find_patches(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  MeshPatches p;
  p.normal.resize(count);
  p.area.resize(count);
  for (std::size_t t = 0; t < count; ++t) {
    const Vec3 a = mesh.vertices[mesh.triangles[t][0]].cast<double>();
    const Vec3 cross = (mesh.vertices[mesh.triangles[t][1]].cast<double>() - a)
                           .cross(mesh.vertices[mesh.triangles[t][2]].cast<double>() - a);
    const double length = cross.norm();
    p.area[t] = 0.5 * length;
    p.normal[t] = length > 0 ? Vec3(cross / length) : Vec3(Vec3::UnitZ());
  }
  p.edges = find_edges(mesh, p.normal);

  std::vector<std::uint32_t> parent(count);
  std::iota(parent.begin(), parent.end(), 0u);
  for (const MeshEdge& e : p.edges) {
    if (std::abs(e.dihedral) > kCoplanar) continue;
    const std::uint32_t a = root_of(parent, e.a), b = root_of(parent, e.b);
    parent[std::max(a, b)] = std::min(a, b);
  }
  p.patch.resize(count);
  std::uint32_t patches = 0;
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t root = root_of(parent, t);
    p.patch[t] = root == t ? patches++ : p.patch[root];  // the root is the smallest, so it has its number already
  }
  p.patch_area.assign(patches, 0);
  p.patch_rim.assign(patches, 0);
  p.patch_smooth_rim.assign(patches, 0);
  for (std::size_t t = 0; t < count; ++t) p.patch_area[p.patch[t]] += p.area[t];
  for (const MeshEdge& e : p.edges) {
    if (p.patch[e.a] == p.patch[e.b]) continue;
    const double smooth = std::abs(e.dihedral) < kSmooth ? e.length : 0.0;
    for (std::uint32_t side : {p.patch[e.a], p.patch[e.b]}) {
      p.patch_rim[side] += e.length;
      p.patch_smooth_rim[side] += smooth;
    }
  }
  // Longest extent: from the box along the farthest vertex of the first one, twice.
  std::vector<Vec3> first(patches), far(patches);
  std::vector<double> extent(patches, -1.0);
  std::vector<std::uint8_t> seen(patches, 0);
  const auto each_vertex = [&](auto&& visit) {
    for (std::size_t t = 0; t < count; ++t)
      for (std::uint32_t v : mesh.triangles[t]) visit(p.patch[t], mesh.vertices[v].cast<double>());
  };
  each_vertex([&](std::uint32_t k, const Vec3& x) {
    if (!seen[k]) first[k] = far[k] = x;
    seen[k] = 1;
    if ((x - first[k]).norm() > (far[k] - first[k]).norm()) far[k] = x;
  });
  each_vertex([&](std::uint32_t k, const Vec3& x) { extent[k] = std::max(extent[k], (x - far[k]).norm()); });
  p.patch_width.resize(patches);
  for (std::uint32_t k = 0; k < patches; ++k) p.patch_width[k] = extent[k] > 0 ? p.patch_area[k] / extent[k] : 0;
  return p;
}

}  // namespace tribin::surfel_detail
