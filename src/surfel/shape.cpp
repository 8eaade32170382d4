#include "surfel/shape.hpp"

#include <algorithm>
#include <cmath>

namespace tribin::surfel_detail {

SurfelShape shape_of(double k1, double k2, double sigma, double max_radius_mm) {
  const double first = std::abs(k1), second = std::abs(k2);
  if (first > 3.0 * sigma) {
    // Curved for sure; where the radius is larger than any that matters, flat.
    if (first * max_radius_mm <= 0.5) return SurfelShape::flat;
    // Ruled if the other curvature is within its own noise or small beside the first.
    const bool ruled = second < std::max(3.0 * sigma, 0.15 * first) && second < 0.5 * first;
    return ruled ? SurfelShape::ruled : SurfelShape::curved;
  }
  // Flat only where a cylinder of the largest radius would have shown: algorithms.md section 15.
  return 3.2 * sigma < 0.7 / max_radius_mm ? SurfelShape::flat : SurfelShape::unknown;
}

}  // namespace tribin::surfel_detail
