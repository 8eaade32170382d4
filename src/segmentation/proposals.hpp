#pragma once

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {

/// A surface that some points speak for.
struct Proposal {
  Surface surface;
  bool axis_held = false;  ///< along a direction that others gave: two numbers fewer
  Indices support;
  double gain = 0;  ///< nats that it saves against its support being unexplained
};

/// Planes, cylinders, cones and spheres from a few points each, of neighbourhoods of free points only, fitted and
/// grown. \param directions  that the axes of narrow ones are held to, where a few points do not hold an axis. \return
/// in a fixed order; what is proposed often already is not sought again. \source Schnabel et al., Efficient RANSAC for
/// point-cloud shape detection, 2007: the local samples.
std::vector<Proposal> propose(Scene& scene, const Limits& limits, std::span<const Vec3> directions,
                              std::size_t free_types = 4, std::size_t most_seeds = 600);

/// The free points nearest to i along the neighbours, i first.
Indices nearest_free(Scene& scene, std::uint32_t i, std::size_t most);

/// Least squares of any type. \param axis_held  keep the axis, a plane's normal too.
Fit fit_any(const Surfels& s, const Indices& support, const Surface& start, bool axis_held);

}  // namespace tribin::segmentation_detail
