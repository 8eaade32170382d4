#include "flat_extent.hpp"

#include <algorithm>
#include <cmath>

#include "views.hpp"

namespace tribin {
namespace {

constexpr double kFlat = 0.01;  // of the diameter: what bends by less may pass for a plane

/// Do both lie in one plane?
bool coplanar(const Primitive& a, const Primitive& b, double off_plane_mm) {
  return a.type == PrimitiveType::plane && b.type == PrimitiveType::plane &&
         a.axis.dot(b.axis) > std::cos(3 * kDegree) && std::abs(a.axis.dot(b.point - a.point)) < off_plane_mm;
}

void add_vertices(const Part& part, const Primitive& p, std::vector<Vec3f>& out) {
  for (const std::uint32_t t : p.surfels)
    for (const std::uint32_t v : part.mesh.triangles[t]) out.push_back(part.mesh.vertices[v]);
}

}  // namespace

double largest_distance(const std::vector<Vec3f>& points, int directions) {
  // Only points that are extreme in some direction can be an end of the diameter.
  std::vector<Vec3f> extreme;
  std::vector<bool> taken(points.size(), false);
  for (const Vec3f& d : golden_spiral(directions)) {
    std::size_t lo = 0, hi = 0;
    float lo_dot = 1e30f, hi_dot = -1e30f;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float x = points[i].dot(d);
      if (x < lo_dot) lo_dot = x, lo = i;
      if (x > hi_dot) hi_dot = x, hi = i;
    }
    for (const std::size_t i : {lo, hi})
      if (i < points.size() && !taken[i]) {
        taken[i] = true;
        extreme.push_back(points[i]);
      }
  }
  double best = 0;
  for (std::size_t i = 0; i < extreme.size(); ++i)
    for (std::size_t j = i + 1; j < extreme.size(); ++j)
      best = std::max(best, static_cast<double>((extreme[i] - extreme[j]).norm()));
  return best;
}

double largest_flat_extent(const Part& part) {
  constexpr int kDirections = 64;  // right to 3 %
  const double bends_mm = kFlat * part.diameter_mm;
  double largest = 0.5 * part.diameter_mm;
  std::vector<bool> done(part.model.primitives.size(), false);
  for (std::size_t i = 0; i < part.model.primitives.size(); ++i) {
    const Primitive& p = part.model.primitives[i];
    if (done[i]) continue;
    std::vector<Vec3f> vertices;
    if (p.type != PrimitiveType::plane) {
      const double chord = 2 * std::sqrt(2 * std::max(0.0, p.radius_mm) * bends_mm);
      add_vertices(part, p, vertices);
      largest = std::max(largest, std::min(std::hypot(p.height_mm(), chord), largest_distance(vertices, kDirections)));
      continue;
    }
    for (std::size_t k = i; k < part.model.primitives.size(); ++k)
      if (k == i || coplanar(p, part.model.primitives[k], bends_mm)) {
        done[k] = true;
        add_vertices(part, part.model.primitives[k], vertices);
      }
    largest = std::max(largest, largest_distance(vertices, kDirections));
  }
  return largest;
}

}  // namespace tribin
