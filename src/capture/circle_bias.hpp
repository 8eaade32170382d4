#pragma once

#include <span>
#include <vector>

#include "capture/bundle.hpp"
#include "tribin/capture/calibrate_rig.hpp"

namespace tribin::calibration_detail {

/// The centroid of the picture of a circle on a board, minus the picture of its centre [px].
/// \source ours: the mean over the disc by rings of points weighed by the area that each covers in the picture; exact
/// to
///         1e-3 of itself for any lens.
Vec2 circle_bias(const Device& device, const Pose& device_from_board, const Vec3& centre, double radius_mm);

/// Takes the bias of circles off: `centred` gets the pixels of `observers` where their centres are, by the poses of the
/// bundle and one radius for all, from the areas. \return false, nothing done, where no area is known.
bool centre_circles(const Board& board, const Bundle& bundle, std::span<const BoardObserver> observers,
                    std::vector<BoardObserver>& centred);

}  // namespace tribin::calibration_detail
