#include "report/shapes.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/cad/half_edges.hpp"

namespace tribin::report {

ShapePoint nearest_on(const Primitive& p, const Vec3& x) {
  const Vec3 from = x - p.point;
  switch (p.type) {
    case PrimitiveType::plane:
      return {x - (p.axis.dot(x) - p.offset_mm) * p.axis, p.axis};
    case PrimitiveType::sphere: {
      const Vec3 normal = from.normalized();
      return {p.point + p.radius_mm * normal, normal};
    }
    case PrimitiveType::torus: {
      const Vec3 along = from.dot(p.axis) * p.axis, middle = p.point + p.radius_mm * (from - along).normalized();
      const Vec3 normal = (x - middle).normalized();
      return {middle + p.minor_radius_mm * normal, normal};
    }
    case PrimitiveType::cylinder: {
      const Vec3 along = from.dot(p.axis) * p.axis, normal = (from - along).normalized();
      return {p.point + along + p.radius_mm * normal, normal};
    }
    case PrimitiveType::cone: {
      const double height = from.dot(p.axis);
      const Vec3 radial = (from - height * p.axis).normalized();
      const double c = std::cos(p.half_angle), s = std::sin(p.half_angle);
      const Vec3 ruling = c * p.axis + s * radial;
      return {p.point + std::max(0.0, from.dot(ruling)) * ruling, c * radial - s * p.axis};
    }
  }
  return {};
}

float tint_of(int id) { return 0.05f * static_cast<float>(id % 3 - 1); }

namespace {

Vec3 normal_of(const Mesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  const Vec3 e1 = mesh.vertices[b].cast<double>() - mesh.vertices[a].cast<double>();
  const Vec3 e2 = mesh.vertices[c].cast<double>() - mesh.vertices[a].cast<double>();
  const Vec3 n = e1.cross(e2);  // its length is twice the area: the weight in sums
  return n;
}

}  // namespace

std::vector<Edge> edges_of(const Mesh& mesh) {
  const double kCrease = std::cos(25 * kDegree);  // finer turns are the facets of a curved face
  std::vector<Edge> out;
  for_each_edge(sorted_half_edges(mesh.triangles), [&](std::span<const HalfEdge> half) {
    Edge edge{half[0].low, half[0].high, static_cast<std::int32_t>(half[0].triangle), -1, true};
    if (half.size() == 2) {
      edge.right = static_cast<std::int32_t>(half[1].triangle);
      edge.crease = normal_of(mesh, edge.left).normalized().dot(normal_of(mesh, edge.right).normalized()) < kCrease;
    }
    out.push_back(edge);
  });
  return out;
}

ShadedSurface surface_of(const Mesh& mesh, const Pose& b_from_part, Material material) {
  // Each triangle has its own corners; a corner's normal is the mean over the triangles at its vertex that turn by less
  // than a crease from it.
  const double kCrease = std::cos(25 * kDegree);
  std::vector<std::vector<std::uint32_t>> at_vertex(mesh.vertices.size());
  std::vector<Vec3> normals(mesh.triangles.size()), units(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    normals[t] = normal_of(mesh, t);
    units[t] = normals[t].normalized();
    for (std::uint32_t v : mesh.triangles[t]) at_vertex[v].push_back(static_cast<std::uint32_t>(t));
  }
  ShadedSurface out;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t v : mesh.triangles[t]) {
      Vec3 sum = Vec3::Zero();
      for (std::uint32_t other : at_vertex[v])
        if (units[t].dot(units[other]) > kCrease) sum += normals[other];
      out.vertices.push_back((b_from_part * mesh.vertices[v].cast<double>()).cast<float>());
      out.normals.push_back((b_from_part.linear() * sum.normalized()).cast<float>());
    }
    const std::uint32_t first = static_cast<std::uint32_t>(3 * t);
    out.triangles.push_back({first, first + 1, first + 2});
  }
  out.materials.assign(mesh.triangles.size(), material);
  return out;
}

void colour_by_primitives(ShadedSurface& surface, const Part& part, const Pose& b_from_part) {
  // A triangle lies on a surface when its corners do, within 0.3 % of the diameter (a coarse chord), and its normal is
  // within 20 degrees (a coarse facet); among those the nearest wins.
  const double reach = 0.003 * part.diameter_mm, turn = std::cos(20 * kDegree);
  const Pose part_from_b = b_from_part.inverse();
  surface.tints.assign(surface.triangles.size(), 0);
  surface.ids.assign(surface.triangles.size(), 0);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    Vec3 corner[3];
    for (int i = 0; i < 3; ++i) corner[i] = part_from_b * surface.vertices[surface.triangles[t][i]].cast<double>();
    const Vec3 middle = (corner[0] + corner[1] + corner[2]) / 3;
    const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    double best = reach;
    surface.materials[t] = Material::none;
    for (const Primitive& p : part.model.primitives) {
      if (std::abs(nearest_on(p, middle).normal.dot(normal)) < turn) continue;
      double worst = 0;
      for (const Vec3& c : corner) worst = std::max(worst, (nearest_on(p, c).point - c).norm());
      if (p.type == PrimitiveType::cylinder) {  // the untrimmed surface goes on: keep to its height
        const double along = (middle - p.point).dot(p.axis);
        if (along < p.extent_min - reach || along > p.extent_max + reach) continue;
      }
      if (worst >= best) continue;
      best = worst;
      surface.materials[t] = material_of(p.type);
      surface.tints[t] = tint_of(p.id);
      surface.ids[t] = static_cast<std::uint16_t>(p.id);
    }
  }
}

void draw_edges(Canvas& canvas, const Mesh& mesh, const std::vector<Edge>& edges, const Pose& b_from_part,
                Material material, double width_px, double halo_px) {
  const Vec3 viewer = canvas.view.view_from_world.row(2).transpose();
  std::vector<char> faces_viewer(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    faces_viewer[t] = (b_from_part.linear() * normal_of(mesh, t)).dot(viewer) < 0;
  const double slack = 1.5 / canvas.view.px_per_mm;  // an edge is as deep as its pixel's neighbours, slopes included
  const auto draw = [&](Material m, double width) {
    for (const Edge& edge : edges) {
      const bool silhouette = edge.right >= 0 && faces_viewer[edge.left] != faces_viewer[edge.right];
      if (!edge.crease && !silhouette) continue;
      canvas.line(b_from_part * mesh.vertices[edge.a].cast<double>(),
                  b_from_part * mesh.vertices[edge.b].cast<double>(), m, width, slack);
    }
  };
  if (halo_px > 0) draw(Material::halo, width_px + 2 * halo_px);
  draw(material, width_px);
}

}  // namespace tribin::report
