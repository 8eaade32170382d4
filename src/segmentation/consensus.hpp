#pragma once

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {

/// Few loose points whose noise shows between neighbours: nothing is decided by a surfel alone. Planes, cylinders,
/// cones and spheres are proposed from a few points of a neighbourhood, grown on the points' distances in sigmas, and
/// taken by what they explain, the best first (Bayesian information criterion over the whole support, all types alike).
/// \source Schnabel et al., Efficient RANSAC for point-cloud shape detection, 2007: the local proposals and the order.
void explain_by_consensus(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found);

/// The surfels with the noise that planes of many points tell, where windows of a few points reach across edges and
/// tell too much. Never more than before.
Surfels with_common_noise(const Surfels& surfels, const Limits& limits);

/// Whether noise, not sampling, is what hides shape, and points are too few for windows that decide.
bool noise_shows(const Scene& scene);

}  // namespace tribin::segmentation_detail
