#pragma once

#include "tribin/part/part.hpp"
#include "tribin/pose/refine.hpp"

namespace tribin {

/// Looks where refinement cannot: along the directions that normals and outlines hold badly, for the place at which the
/// depth image is likeliest. Teeth, steps and bores that a spin or a slide carries over the pixels tell there, though
/// no normal leans that way. The pose moves to the best place, and the information learns how fast the likelihood
/// falls.
/// \param frozen  free directions by symmetry, as in RefineOptions.
/// \cost  some 25 renders a direction, two directions at most, none where all are held
/// \source ours.
void settle_weak_directions(const Part& part, const SceneDepth& scene, std::span<const Vector6> frozen, int step_px,
                            Refinement& refined);

}  // namespace tribin
