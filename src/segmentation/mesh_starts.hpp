#pragma once

#include "segmentation/fitting.hpp"

namespace tribin::segmentation_detail {

/// Surfaces that a few neighbouring facets may lie on, in closed form from their normals, those with fewest parameters
/// first: cylinder, cones, sphere, tori. A facet's normal is that of the surface up to its own turn, so these are
/// starts for a fit on the vertices.
std::vector<Surface> starts_on_mesh(const Surfels& surfels, const Indices& near);

/// The cone of a fan: facets that share one corner, the apex. Directions d from it to the others have d.a = cos(half
/// angle): linear in a / cos(half angle). A fan has but one circle of corners beside its apex, where distances have no
/// derivative, so that no fit on distances finds it. \return radius 0 where the facets are no fan.
Surface cone_from_fan(const Surfels& surfels, const Indices& fan);

/// Do the facets of a mesh keep one angle to some axis? The corners of one ring of facets lie on a cylinder, on cones
/// and on spheres alike; a ring of facets says nothing of a ball.
bool is_ring(const Surfels& surfels, const Indices& support);

/// Length of the edge that two facets share [mm]; 0 where they share none.
double common_edge_mm(const Surfels& surfels, std::uint32_t i, std::uint32_t j);

}  // namespace tribin::segmentation_detail
