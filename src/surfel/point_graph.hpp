#pragma once

#include "surfel/point_tree.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin::surfel_detail {

/// Normals with a sigma of this or more are not known [rad].
inline constexpr float kUnknownNormal = 1.0f;

/// Gives all normals one side. With a viewpoint: towards it. Without: along the minimum spanning tree of the
/// neighbours, from the outermost point of each connected piece, whose normal points outwards: right for closed
/// surfaces, and of one sign on every smooth patch; across creases and narrow gaps it may fail.
/// \source Hoppe et al., Surface reconstruction from unorganized points, 1992.
void orient_normals(Surfels& s, const std::vector<std::vector<std::uint32_t>>& near,
                    const std::optional<Vec3>& viewpoint);

/// Neighbours: the nearest points, either way, whose tangent planes meet half way where both are of one direction:
/// a crease passes, a step does not.
void connect_points(Surfels& s, const std::vector<std::vector<std::uint32_t>>& near);

}  // namespace tribin::surfel_detail
