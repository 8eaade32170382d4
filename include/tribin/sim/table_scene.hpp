#pragma once

#include <cstdint>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/geometry.hpp"
#include "tribin/sim/stable_rests.hpp"

namespace tribin::sim {

/// A square table top in z = 0, z up, centred at the origin.
Mesh table_mesh(double side_mm = 4000);

/// The camera above the origin of the table, looking at it. \param tilt [rad] from straight down, towards `azimuth`.
Pose camera_above(double distance_mm, double tilt, double azimuth);

/// A rest turned by `yaw` about the vertical and moved to (x, y).
Pose placed(const StableRest& rest, double yaw, double x, double y);

/// One part to lie on the table.
struct TablePart {
  const Mesh* mesh = nullptr;
  const std::vector<StableRest>* rests = nullptr;
};

/// Lays parts side by side, each in a rest drawn by its probability, yaw and place drawn; no two overlap, seen from
/// above by their bounding circles. \return table_from_part of each; a part for which 500 draws find no room is left
/// out (its index is not in `laid`). \param half_width, half_height  of the area in which the circles must lie [mm].
struct Layout {
  std::vector<int> laid;              ///< indices into the parts
  std::vector<Pose> table_from_part;  ///< of each laid part
};
Layout lay_on_table(const std::vector<TablePart>& parts, double half_width, double half_height, std::uint64_t seed);

/// Radius about the centre of mass of the part's outline seen from above [mm].
double radius_from_above(const Mesh& mesh, const StableRest& rest);

}  // namespace tribin::sim
