#pragma once

#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin::sim {

/// A way in which a part lies still on a table.
struct StableRest {
  Pose table_from_part = Pose::Identity();  ///< table z = 0, z up; centre of mass above the origin
  double probability = 0;  ///< solid angle of the supporting face seen from the centre of mass; the rests' sum is 1
  double margin_mm = 0;    ///< distance of the centre of mass's foot from the rim of the support
};

/// All rests of a part of uniform density, most probable first: faces of the convex hull (coplanar ones are one) over
/// which the centre of mass stands. A round side is many narrow faces; those within 10 degrees are one rest. Rests that
/// a touch would end (margin < 0.3 % of the diameter) or that are hardly ever met (< 0.5 %) are left out.
/// \throws Error too_little_data for a mesh without volume.
std::vector<StableRest> stable_rests(const Mesh& mesh);

/// Centre of mass of the solid that the mesh bounds.
/// \source divergence theorem over tetrahedra from the origin.
Vec3 centre_of_mass(const Mesh& mesh);

}  // namespace tribin::sim
