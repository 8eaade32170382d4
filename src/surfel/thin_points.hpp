#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin::surfel_detail {

/// Loose points with duplicates joined, and thinned to means over cubes where there are more than can be afforded.
struct ThinPoints {
  std::vector<Vec3f> position;
  std::vector<std::uint32_t> points;    ///< raw points behind each
  std::vector<std::uint32_t> of_point;  ///< per raw point: its place in `position`
};

/// \param most  about how many to keep.
ThinPoints thin_points(std::span<const Vec3f> points, std::size_t most);

}  // namespace tribin::surfel_detail
