#pragma once

#include "tribin/surfel/surfels.hpp"

namespace tribin::surfel_detail {

/// What curvatures k1 (the larger) and k2 prove against the sigma of k1 [1/mm]: the same rules for all sources.
SurfelShape shape_of(double k1, double k2, double sigma, double max_radius_mm);

}  // namespace tribin::surfel_detail
