#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin::io {

/// A mesh of polygons as the cage of a subdivision surface.
struct SubdivisionCage {
  std::vector<Vec3> points;
  std::vector<std::vector<std::uint32_t>> faces;  ///< corners, 3 or more each

  struct Crease {
    std::array<std::uint32_t, 2> ends;
    double sharpness = 0;  ///< steps for which the edge stays sharp; infinite = for good
  };
  std::vector<Crease> creases;
};

/// One step of smoothing: each polygon of n corners becomes n quadrangles. Rims, and edges of three faces or more, stay
/// sharp. \source Catmull and Clark 1978; creases as DeRose, Kass and Truong 1998, section 3.
SubdivisionCage subdivide(const SubdivisionCage& cage);

}  // namespace tribin::io
