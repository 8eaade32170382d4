#pragma once

#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin::sim {

/// The faces of the convex hull of points: each a convex polygon of indices into the points. Bullet computes on a grid
/// of 1/10,000 of the extent, so that points that near may change places.
/// Empty when there are fewer than 4 points.
std::vector<std::vector<int>> convex_hull(std::span<const Vec3> points);

}  // namespace tribin::sim
