#include "tribin/cad/half_edges.hpp"
#include "tribin/pose/index_render.hpp"

namespace tribin {
namespace {

/// Every edge once, without those between coplanar triangles, which are never an outline.
std::vector<OutlineEdge> outline_edges(const RenderMesh& mesh) {
  std::vector<OutlineEdge> out;
  for_each_edge(sorted_half_edges(mesh.triangles), [&](std::span<const HalfEdge> edge) {
    if (edge.size() > 2) return;  // where shells touch
    const std::uint32_t left = edge[0].triangle, right = edge.back().triangle;
    if (edge.size() == 2 && mesh.normals[left].dot(mesh.normals[right]) > 0.999999f) return;
    out.push_back({{edge[0].low, edge[0].high},
                   {static_cast<std::int32_t>(left), edge.size() == 2 ? static_cast<std::int32_t>(right) : -1}});
  });
  return out;
}

}  // namespace

RenderMesh make_render_mesh(const Mesh& mesh) {
  RenderMesh out;
  out.vertices = mesh.vertices;
  out.triangles = mesh.triangles;
  out.two_sided = !mesh.oriented;
  out.normals.reserve(mesh.triangles.size());
  out.offsets.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    const Eigen::Vector3d n = (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a);
    const double length = n.norm();
    out.normals.push_back(length > 0 ? Vec3f((n / length).cast<float>()) : Vec3f(0, 0, 0));
    out.offsets.push_back(static_cast<float>(out.normals.back().cast<double>().dot(a)));
  }
  out.edges = outline_edges(out);
  if (!mesh.vertices.empty()) {
    out.box_min = out.box_max = mesh.vertices[0].cast<double>();
    for (const Vec3f& v : mesh.vertices) {
      out.box_min = out.box_min.cwiseMin(v.cast<double>());
      out.box_max = out.box_max.cwiseMax(v.cast<double>());
    }
  }
  return out;
}

}  // namespace tribin
