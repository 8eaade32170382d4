#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "tribin/recognition/instance.hpp"

namespace tribin {

/// A plane that things lie on: dot(up, x) = offset_mm, `up` towards the camera.
struct Ground {
  Vec3 up = Vec3::UnitZ();
  double offset_mm = 0;
};

/// The plane of the scan that a piece of it lies on or before: the one most met around it. None where no plane of the
/// segmentation is.
std::optional<Ground> ground_around(const Surfels& surfels, const Primitives& primitives,
                                    std::span<const std::uint32_t> members);

/// Centre, pixels, and volume above a ground (0 without one): the sum of each surfel's height times its area on the
/// ground.
UnexplainedRegion region_of(const Surfels& surfels, std::span<const std::uint32_t> members,
                            const std::optional<Ground>& ground);

}  // namespace tribin
