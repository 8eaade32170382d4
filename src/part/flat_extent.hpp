#pragma once

#include <vector>

#include "tribin/part/part.hpp"

namespace tribin {

/// Largest distance between two points of a set [mm], looked for among those that are extreme in one of `directions`
/// directions: too small by (pi / 2 directions) at most, of its square.
double largest_distance(const std::vector<Vec3f>& points, int directions);

/// The largest distance between two points of the part's surface that a scan may show as one plane [mm]: of faces that
/// lie in one plane together, and of other surfaces the strip along their axis that bends by less than 1 % of the
/// diameter. At least half a diameter, for free forms, of which the CAD knows no primitive.
/// \param part  with mesh, diameter and model.
double largest_flat_extent(const Part& part);

}  // namespace tribin
