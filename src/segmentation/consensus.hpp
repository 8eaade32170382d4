#pragma once

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {

/// Few loose points whose noise shows between neighbours: nothing is decided by a surfel alone. Planes, cylinders,
/// cones and spheres are proposed from neighbourhoods and offered to all points; each point takes one, or none, so that
/// the whole is shortest to write down: distances, rims and the surfaces themselves.
/// \cost   1 to 3 s for 2000 points (2 cores).
/// \source Isack and Boykov, Energy-based geometric multi-model fitting, 2012; the costs and offers are ours
///         (docs/segmentation.md).
void explain_by_consensus(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found);

/// The surfels again with one noise for all, that by which the cloud's planes are shortest to write down, where windows
/// of a few points reach across edges and tell too much.
Surfels with_common_noise(const Surfels& surfels, const Limits& limits);

/// Whether noise, not sampling, is what hides shape, and points are too few for windows that decide.
bool noise_shows(const Scene& scene);

}  // namespace tribin::segmentation_detail
