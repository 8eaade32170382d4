#pragma once

#include <span>

#include "tribin/model/primitive_model.hpp"
#include "tribin/part/part.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin::paper {

/// Finds parts as the paper does, on the same primitives as recognize(): M to N matching of cylinders, two key
/// cylinders with their planes, rotation from two axes, translation from four intersection points, ICP. At most one
/// part for each thing on the table; the evidence holds every test's value and limit, `rejected` those that failed.
/// The covariance is the size of the misfit, not a propagated error: the paper has none.
/// \source Barajas et al., sections IV-B and IV-C; what was mended and chosen: docs/paper_method.md.
Instances recognize(const Primitives& primitives, const PrimitiveModel& observation, const Surfels& surfels,
                    std::span<const Part> parts);

}  // namespace tribin::paper
