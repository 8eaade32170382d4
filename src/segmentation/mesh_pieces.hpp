#pragma once

#include "segmentation/region.hpp"

namespace tribin::segmentation_detail {

// What is other on a mesh: its corners are exact, but there are few, and tangent surfaces make one component.

/// Do the facets of a mesh keep one angle to some axis? The corners of one ring of facets lie on a cylinder, on cones
/// and on spheres alike; a ring of facets says nothing of a ball.
bool is_ring(const Surfels& surfels, const Indices& support);

/// A component may hold several surfaces that are tangent: adds the neighbourhoods of its largest facets, each of which
/// lies on one of them.
void add_neighbourhoods(Scene& scene, std::vector<Indices>& components);

}  // namespace tribin::segmentation_detail
