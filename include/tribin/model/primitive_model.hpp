#pragma once

#include <vector>

#include "tribin/segmentation/primitives.hpp"

namespace tribin {

enum class RelationType : std::uint8_t {
  plane_plane,
  plane_cylinder,
  cylinder_cylinder
};  ///< cones count as cylinders

/// How two primitives lie to each other, and where they meet.
struct Relation {
  int first = 0;  ///< primitive ids, first < second
  int second = 0;
  RelationType type = RelationType::plane_plane;
  double angle = 0;        ///< [rad] between the axes, in [0, pi/2]
  double distance_mm = 0;  ///< between axes (cylinders), between parallel planes, of the centre from the plane
  bool adjacent = false;   ///< their supports touch
  bool coaxial = false;
  Vec3 line_point = Vec3::Zero();      ///< intersection line of two planes; intersection of axis and plane
  Vec3 line_direction = Vec3::Zero();  ///< zero where they meet in a point only
};

/// Primitives with their relations: the paper's "model" (from CAD) or "observation" (from a scan).
struct PrimitiveModel {
  std::vector<Primitive> primitives;
  std::vector<Relation> relations;
};

/// \source Barajas et al., section IV-A: amounts, radii and heights, intersection lines and points.
PrimitiveModel build_model(const Primitives& primitives, const Surfels& surfels);

}  // namespace tribin
