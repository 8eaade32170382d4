#pragma once

#include <cmath>

#include "tribin/part/part.hpp"

namespace tribin {

/// Which mesh of a part pixels are compared with. `coarse` costs a half to a third and lies off by less than a look at
/// some thousand pixels can tell.
enum class Detail { coarse, full };

inline const RenderMesh& mesh_of(const Part& part, Detail detail) {
  return detail == Detail::coarse ? part.coarse_mesh : part.render_mesh;
}

/// Sd of that mesh about the part's surface [mm].
inline double cad_sigma_mm(const Part& part, Detail detail) {
  // Where edges are collapsed the surface is off by a third of the most, in the mean.
  return detail == Detail::coarse ? std::hypot(part.mesh.chord_error_mm, part.coarse_error_mm / 3)
                                  : part.mesh.chord_error_mm;
}

}  // namespace tribin
