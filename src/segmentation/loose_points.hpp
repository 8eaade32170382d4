#pragma once

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {

/// Loose points only: gives every surfel to the surface that it lies on best, its own or one beside it, whatever its
/// normal says: beside edges normals say little, distances all. Surfaces that keep nothing are left without support.
void claim_points(Scene& scene, const std::vector<FoundSurface>& found);

/// Loose points only: what is not explained is fitted and segmented again, without the neighbours that are, until
/// nothing more comes out. Faces a few points wide have no window of their own before.
void explain_rest(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found);

}  // namespace tribin::segmentation_detail
