#pragma once

#include "tribin/part/part.hpp"

namespace tribin {

/// Unit vectors of an icosahedron split twice: 162 directions, about 16 deg apart.
std::vector<Vec3> view_directions();

/// Fills part.views, part.sample_points, part.sample_normals and part.exposed_mm2 by rendering the part from
/// view_directions().
void make_views(Part& part);

}  // namespace tribin
