#pragma once

#include "tribin/core/geometry.hpp"

namespace tribin {

/// The point of the triangle (a, a + ab, a + ac) that is nearest to p.
/// \source Ericson, Real-Time Collision Detection, 5.1.5: by Voronoi regions.
Vec3 nearest_on_triangle(const Vec3& a, const Vec3& ab, const Vec3& ac, const Vec3& p);

}  // namespace tribin
