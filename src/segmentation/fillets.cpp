#include "segmentation/fillets.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "segmentation/fitting.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kTangent = 10 * kDegree;      // an edge that a designer meant turns by more
constexpr double kLargestArc = 130 * kDegree;  // the round end of a lug or a slot is no fillet
constexpr double kShare = 0.6;  // of the border on a side that goes over smoothly; the rest meets other edges

/// Where two neighbouring surfels meet, and which way the second lies from there.
struct Meeting {
  Vec3 place = Vec3::Zero(), direction = Vec3::Zero();  ///< direction: unit, from the first's side to the second's
  double length = 0;                                    ///< of the border [mm]
};

bool meet(const Surfels& s, std::uint32_t i, std::uint32_t j, Meeting& out) {
  const Vec3 between = (s.position[j] - s.position[i]).cast<double>();
  if (s.mesh == nullptr) {
    out.place = 0.5 * (s.position[i] + s.position[j]).cast<double>();
    out.direction = between.normalized();
    out.length = std::sqrt(static_cast<double>(s.area_mm2[i]));
    return true;
  }
  Vec3 corners[2];
  int count = 0;
  for (const std::uint32_t v : s.mesh->triangles[i])
    if (const auto& t = s.mesh->triangles[j]; std::find(t.begin(), t.end(), v) != t.end() && count < 2)
      corners[count++] = s.mesh->vertices[v].cast<double>();
  if (count < 2) return false;
  const Vec3 edge = corners[1] - corners[0];
  out.place = 0.5 * (corners[0] + corners[1]);
  out.length = edge.norm();
  if (!(out.length > 0)) return false;
  // Across the edge, in the first's plane: a long triangle's middle lies anywhere.
  const Vec3 across = s.normal[i].cast<double>().cross(edge / out.length);
  out.direction = across.dot(between) > 0 ? across : Vec3(-across);
  return true;
}

/// Unit vector on the surface, at x, across its bend: round a cylinder, round the tube of a torus.
Vec3 across_bend(const Surface& surface, const Vec3& x) {
  const Vec3 radial = x - surface.point - surface.axis * surface.axis.dot(x - surface.point);
  const Vec3 round = surface.axis.cross(radial.normalized());
  return surface.type == PrimitiveType::torus ? Vec3(round.cross(surface.normal(x))) : round;
}

}  // namespace

void mark_fillets(Primitives& primitives, const Surfels& s) {
  std::vector<Surface> surfaces;
  for (const Primitive& p : primitives.items) surfaces.push_back(surface_of(p));
  parallel_each(static_cast<int>(surfaces.size()), [&](int k) {
    Primitive& p = primitives.items[static_cast<std::size_t>(k)];
    p.fillet = false;
    if (p.type != PrimitiveType::torus && !(p.type == PrimitiveType::cylinder && p.arc < kLargestArc)) return;
    const Surface& own = surfaces[static_cast<std::size_t>(k)];
    double border[2] = {0, 0}, smooth[2] = {0, 0};
    for (const std::uint32_t i : p.surfels)
      for (std::uint32_t n = s.neighbour_begin[i]; n < s.neighbour_begin[i + 1]; ++n) {
        const std::uint32_t j = s.neighbours[n];
        const int label = primitives.label_of_surfel[j];
        Meeting at;
        if (label == p.id || !meet(s, i, j, at)) continue;
        const double side = at.direction.dot(across_bend(own, at.place));
        if (std::abs(side) < 0.7) continue;  // it goes on along the axis
        border[side > 0] += at.length;
        if (label == 0) continue;
        const Vec3 other = surfaces[static_cast<std::size_t>(label - 1)].normal(at.place);
        if (std::abs(own.normal(at.place).dot(other)) > std::cos(kTangent)) smooth[side > 0] += at.length;
      }
    p.fillet = std::min(smooth[0], smooth[1]) > 0 && smooth[0] > kShare * border[0] && smooth[1] > kShare * border[1];
  });
}

}  // namespace tribin::segmentation_detail
