#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "tribin/core/parallel.hpp"
#include "tribin/model/primitive_model.hpp"

namespace tribin {
namespace {

constexpr double kParallel = 2.0 * kDegree;  // below, an intersection line is no better known than by the noise
constexpr double kSigmas = 4.0;

/// Pairs of primitives whose supports touch: neighbouring surfels, one rejected cell between them (an edge leaves one),
/// or on a mesh a common vertex.
std::set<std::pair<int, int>> touching(const Primitives& primitives, const Surfels& s) {
  std::set<std::pair<int, int>> pairs;
  const std::vector<std::int32_t>& label = primitives.label_of_surfel;
  const auto add = [&](int a, int b) {
    if (a > 0 && b > 0 && a != b) pairs.emplace(std::min(a, b), std::max(a, b));
  };
  if (s.mesh != nullptr) {
    std::vector<std::vector<int>> at_vertex(s.mesh->vertices.size());
    for (std::size_t t = 0; t < s.mesh->triangles.size(); ++t)
      for (std::uint32_t v : s.mesh->triangles[t]) {
        std::vector<int>& labels = at_vertex[v];
        if (label[t] > 0 && std::find(labels.begin(), labels.end(), label[t]) == labels.end())
          labels.push_back(label[t]);
      }
    for (const std::vector<int>& labels : at_vertex)
      for (int a : labels)
        for (int b : labels) add(a, b);
    return pairs;
  }
  for (std::uint32_t i = 0; i < s.size(); ++i)
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k)
      add(label[i], label[s.neighbours[k]]);
  if (s.scan == nullptr) return pairs;
  // Across one rejected cell, unless a depth step lies there: then the two are neighbours in the picture only.
  const Image<std::int32_t>& cells = s.surfel_of_cell;
  for (int v = 0; v < cells.height; ++v)
    for (int u = 0; u < cells.width; ++u) {
      if (cells(u, v) >= 0) continue;
      for (const auto& [du, dv] : {std::pair{1, 0}, std::pair{0, 1}}) {
        if (!cells.contains(u - du, v - dv) || !cells.contains(u + du, v + dv)) continue;
        const std::int32_t i = cells(u - du, v - dv), j = cells(u + du, v + dv);
        if (i < 0 || j < 0) continue;
        const double gap = (s.position[i] - s.position[j]).norm();
        const double lateral = std::sqrt(static_cast<double>(std::min(s.area_mm2[i], s.area_mm2[j])));
        if (gap < 3.5 * lateral) add(label[i], label[j]);  // two cells apart, and what a 45 deg edge adds
      }
    }
  return pairs;
}

void intersect_planes(const Primitive& a, const Primitive& b, Relation& r) {
  if (r.angle < kParallel) {
    r.distance_mm = std::abs(a.axis.dot(b.point - a.point));
    return;
  }
  r.line_direction = a.axis.cross(b.axis).normalized();
  Matrix3 m;
  m.row(0) = a.axis.transpose();
  m.row(1) = b.axis.transpose();
  m.row(2) = r.line_direction.transpose();
  // The place of the line that is nearest to the middle of the two supports.
  const Vec3 middle = 0.5 * (a.point + b.point);
  r.line_point = m.inverse() * Vec3(a.offset_mm, b.offset_mm, r.line_direction.dot(middle));
}

void intersect_plane_axis(const Primitive& plane, const Primitive& round, Relation& r) {
  const double along = plane.axis.dot(round.axis);
  r.distance_mm = std::abs(plane.axis.dot(round.point) - plane.offset_mm);
  if (round.type == PrimitiveType::sphere) return;
  if (std::abs(along) < std::sin(kParallel)) return;  // the axis runs along the plane
  r.line_point = round.point + round.axis * ((plane.offset_mm - plane.axis.dot(round.point)) / along);
}

void relate_axes(const Primitive& a, const Primitive& b, Relation& r) {
  const Vec3 q = b.point - a.point;
  const Vec3 cross = a.axis.cross(b.axis);
  r.distance_mm = r.angle < kParallel ? (q - a.axis * a.axis.dot(q)).norm() : std::abs(q.dot(cross.normalized()));
  // Coaxial within what the covariances allow, over the gap between the two supports.
  const double tilt = std::sqrt(a.covariance(0, 0) + a.covariance(1, 1) + b.covariance(0, 0) + b.covariance(1, 1));
  const double shift = std::sqrt(a.covariance(2, 2) + a.covariance(3, 3) + b.covariance(2, 2) + b.covariance(3, 3));
  const double reach = 0.5 * q.norm();
  r.coaxial = r.angle < kSigmas * tilt + 0.2 * kDegree &&
              (q - a.axis * a.axis.dot(q)).norm() < kSigmas * (shift + reach * tilt) + 1e-2 + reach * 0.2 * kDegree;
}

bool has_axis(const Primitive& p) { return p.type == PrimitiveType::cylinder || p.type == PrimitiveType::cone; }

}  // namespace

PrimitiveModel build_model(const Primitives& primitives, const Surfels& surfels) {
  PrimitiveModel model;
  model.primitives = primitives.items;
  const std::set<std::pair<int, int>> pairs = touching(primitives, surfels);
  for (std::size_t i = 0; i < model.primitives.size(); ++i)
    for (std::size_t j = i + 1; j < model.primitives.size(); ++j) {
      const Primitive &a = model.primitives[i], &b = model.primitives[j];
      Relation r;
      r.first = a.id;
      r.second = b.id;
      r.adjacent = pairs.count({a.id, b.id}) > 0;
      r.angle = std::acos(std::clamp(std::abs(a.axis.dot(b.axis)), 0.0, 1.0));
      const bool plane_a = a.type == PrimitiveType::plane, plane_b = b.type == PrimitiveType::plane;
      if (plane_a && plane_b) {
        r.type = RelationType::plane_plane;
        intersect_planes(a, b, r);
      } else if (plane_a || plane_b) {
        if (!has_axis(plane_a ? b : a)) continue;
        r.type = RelationType::plane_cylinder;
        intersect_plane_axis(plane_a ? a : b, plane_a ? b : a, r);
      } else {
        if (!has_axis(a) || !has_axis(b)) continue;
        r.type = RelationType::cylinder_cylinder;
        relate_axes(a, b, r);
      }
      model.relations.push_back(r);
    }
  return model;
}

}  // namespace tribin
