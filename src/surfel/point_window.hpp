#pragma once

#include "surfel/point_quadric.hpp"
#include "surfel/point_tree.hpp"

namespace tribin::surfel_detail {

/// The points of one smooth surface about a loose point, and the quadric through them: windows do not reach across
/// edges, nor to the other side of a thin wall.
struct PointWindow {
  PointQuadric quadric;  ///< valid() where the normal is known
  bool bends = false;    ///< the quadric holds; else it is a plane through too few points to tell more
};

/// The smallest window: the plane through the point and two of its neighbours that most neighbours are near to, then a
/// quadric through those, chosen again by their residuals.
/// \param near     the nearest points, nearest first, `near[0]` the point itself.
/// \param spacing  of the points [mm].
/// \source least trimmed squares over triples: Li et al., Robust normal estimation for point clouds with sharp
/// features, 2010; the allowance for bending is ours.
PointWindow smallest_window(std::span<const Vec3f> points, std::span<const std::uint32_t> near, double spacing);

/// Where noise hides which it is, the window that is flat within 3 sigma, if it holds most points of `bent`: else edges
/// of sparse clouds come out as cylinders.
PointWindow flat_or(const PointWindow& bent, std::span<const Vec3f> points, std::span<const std::uint32_t> near,
                    double sigma);

/// The next larger window: of the `near` points those that lie on the quadric within 4 sigma. \return an invalid one
/// where it no longer fits, or where nothing is gained.
PointWindow larger_window(std::span<const Vec3f> points, std::span<const std::uint32_t> near, const PointWindow& from,
                          double sigma);

}  // namespace tribin::surfel_detail
