#pragma once

#include <array>
#include <optional>

#include "tribin/core/geometry.hpp"

namespace tribin {

/// Lens distortion by Brown's model, as OpenCV has it: k1, k2, p1, p2, k3, on coordinates x / z, y / z.
using Distortion = std::array<double, 5>;

/// Where the lens puts an ideal image point. Both in units of x / z, y / z.
Vec2 distorted(const Distortion& distortion, const Vec2& ideal);

/// The ideal point of one that the lens has moved; none where the model folds the image there.
std::optional<Vec2> undistorted(const Distortion& distortion, const Vec2& seen);

}  // namespace tribin
