#include "io/subdivision.hpp"

#include <algorithm>
#include <map>

namespace tribin::io {
namespace {

struct Edge {
  Vec3 face_points = Vec3::Zero();  ///< sum over the faces beside it
  int faces = 0;
  double sharpness = 0;
  std::uint32_t point = 0;  ///< index of its new point
};

using Ends = std::array<std::uint32_t, 2>;

Ends ends_of(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// What meets at a vertex.
struct Corner {
  Vec3 face_points = Vec3::Zero(), midpoints = Vec3::Zero(), sharp_ends = Vec3::Zero();
  int faces = 0, edges = 0, sharp = 0;
  double sharpness = 0;  ///< mean of the sharp edges', below 1 a blend of both rules
};

Vec3 moved(const Vec3& p, const Corner& c) {
  if (c.faces == 0 || c.edges < 2) return p;
  const double n = c.edges;
  const Vec3 smooth = Vec3(c.face_points / c.faces + 2.0 * c.midpoints / n + (n - 3) * p) / n;
  if (c.sharp < 2) return smooth;
  const Vec3 creased = c.sharp == 2 ? Vec3((6.0 * p + c.sharp_ends) / 8.0) : p;
  const double blend = std::min(1.0, c.sharpness / c.sharp);
  return blend * creased + (1 - blend) * smooth;
}

}  // namespace

SubdivisionCage subdivide(const SubdivisionCage& cage) {
  SubdivisionCage next;
  next.points = cage.points;
  std::map<Ends, Edge> edges;
  std::vector<Corner> corners(cage.points.size());
  const auto first_face_point = static_cast<std::uint32_t>(next.points.size());
  for (const auto& face : cage.faces) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t k : face) middle += cage.points[k] / static_cast<double>(face.size());
    next.points.push_back(middle);
    for (std::size_t i = 0; i < face.size(); ++i) {
      Edge& edge = edges[ends_of(face[i], face[(i + 1) % face.size()])];
      edge.face_points += middle;
      ++edge.faces;
      corners[face[i]].face_points += middle;
      ++corners[face[i]].faces;
    }
  }
  for (const SubdivisionCage::Crease& crease : cage.creases)
    if (const auto edge = edges.find(ends_of(crease.ends[0], crease.ends[1])); edge != edges.end())
      edge->second.sharpness = crease.sharpness;
  constexpr double kForGood = std::numeric_limits<double>::infinity();
  for (auto& [ends, edge] : edges) {
    if (edge.faces != 2) edge.sharpness = kForGood;
    const Vec3 &a = cage.points[ends[0]], &b = cage.points[ends[1]], middle = 0.5 * (a + b);
    const double blend = std::min(1.0, edge.sharpness);
    edge.point = static_cast<std::uint32_t>(next.points.size());
    next.points.push_back(blend * middle + (1 - blend) * (0.5 * middle + 0.25 * edge.face_points));
    for (int side = 0; side < 2; ++side) {
      Corner& corner = corners[ends[side]];
      corner.midpoints += middle;
      ++corner.edges;
      if (edge.sharpness <= 0) continue;
      ++corner.sharp;
      corner.sharpness += blend;
      corner.sharp_ends += cage.points[ends[1 - side]];
    }
    if (edge.sharpness > 1 && edge.faces == 2) {
      next.creases.push_back({{ends[0], edge.point}, edge.sharpness - 1});
      next.creases.push_back({{edge.point, ends[1]}, edge.sharpness - 1});
    }
  }
  for (std::size_t i = 0; i < cage.points.size(); ++i) next.points[i] = moved(cage.points[i], corners[i]);
  for (std::size_t f = 0; f < cage.faces.size(); ++f) {
    const auto& face = cage.faces[f];
    const std::size_t n = face.size();
    for (std::size_t i = 0; i < n; ++i)
      next.faces.push_back({face[i], edges.at(ends_of(face[i], face[(i + 1) % n])).point,
                            first_face_point + static_cast<std::uint32_t>(f),
                            edges.at(ends_of(face[(i + n - 1) % n], face[i])).point});
  }
  return next;
}

}  // namespace tribin::io
