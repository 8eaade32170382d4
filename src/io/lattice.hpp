#pragma once

#include <optional>

#include "io/raw_cloud.hpp"

namespace tribin::io {

/// The grid of loose points that a depth camera saw and a program wrote without its holes: from the camera, all of them
/// look through the pixels of one regular lattice.
/// \param cloud  loose points in the camera's own frame, z along the view or against it.
/// \return the same points on their grid, holes as NaN, with a warning that says so; nothing where there is no such
/// lattice (points of several views, resampled or moved ones).
/// \cost some 0.2 s for 50 000 points.
std::optional<RawCloud> regain_grid(const RawCloud& cloud);

}  // namespace tribin::io
