#pragma once

#include <cstdint>
#include <vector>

#include "tribin/model/primitive_model.hpp"

namespace tribin::paper {

/// One thing in the scan that could be the object: the paper's "observation", with its sets of cylinders and planes.
struct Object {
  std::vector<std::uint32_t> surfels;
  std::vector<const Primitive*> cylinders;  ///< convex ones, largest radius first; of the observation given
  std::vector<const Primitive*> planes;     ///< largest area first
};

/// Parts the scan into things that could be objects: what does not lie on a surface larger than any part, joined
/// wherever it is closer than a gap. Largest area first.
/// \param largest_mm   diameter of the largest part: a plane that reaches further is the table.
/// \param smallest_mm  diameter of the smallest part: the gap is 5 % of it, the distance by which answers are judged.
/// \source section III-B, "we can also segment parts in 3D and 2D image spaces using a distance based classifier"; the
///         paper shows one object a scan and does not say how it was cut out.
std::vector<Object> objects_in(const Primitives& primitives, const PrimitiveModel& observation, const Surfels& surfels,
                               double largest_mm, double smallest_mm);

}  // namespace tribin::paper
