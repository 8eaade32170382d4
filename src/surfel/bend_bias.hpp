#pragma once

#include <vector>

#include "tribin/surfel/surfels.hpp"

namespace tribin::surfel_detail {

/// What a plane fit over a window is off from the normal at its centre because the surface bends: per surfel of a scan,
/// from its own curvatures (third derivatives of depth follow from them, seen aslant). Zero where the curvature is not
/// proven: on flats nothing is added, noise least of all.
/// \param window_px  side of the window.
std::vector<Vec3f> bend_bias(const Surfels& surfels, int window_px);

}  // namespace tribin::surfel_detail
