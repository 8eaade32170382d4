#pragma once

#include <span>

#include "tribin/cad/mesh.hpp"

namespace tribin {

/// An axis-parallel box; empty (min > max) for no points.
struct Box {
  Vec3 min = Vec3::Constant(1e300);
  Vec3 max = Vec3::Constant(-1e300);

  Vec3 size() const { return max - min; }
  Vec3 center() const { return 0.5 * (min + max); }
};

Box bounding_box(std::span<const Vec3f> points);

/// The largest distance between two points [mm], exact. \source Ours: points are cut off by the bound |p - c| + r_max
/// < best, with c the box's centre, until few are left; those are compared in pairs.
double diameter(std::span<const Vec3f> points);

/// Surface [mm^2].
double surface_area(const Mesh& mesh);

/// Volume [mm^3] by the divergence theorem; > 0 for a closed mesh wound outward, meaningless for an open one.
double signed_volume(const Mesh& mesh);

}  // namespace tribin
