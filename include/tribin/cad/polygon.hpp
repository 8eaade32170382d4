#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin {

/// Cuts a polygon in space into triangles, of its own winding: a fan where it is convex, else by its ears.
/// \param corners  3 or more, nearly in a plane; repeated corners are allowed.
/// \return         Triples of indices into `corners`. A polygon that crosses itself gets a fan of what is left.
/// \cost           O(n^2); a concave polygon of more than 1024 corners is cut as a fan.
std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const Vec3> corners);

}  // namespace tribin
