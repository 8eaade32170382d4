#pragma once

#include <string>
#include <vector>

#include "mesh_tree.hpp"
#include "tribin/grasp/candidates.hpp"

// Where a gripper could stand by a part's primitives, before its triangles are asked.
namespace tribin::grasp {

struct Seed {
  Pose part_from_tcp = Pose::Identity();
  std::string family;
  double priority = 1;
  bool taught = false;
  bool spare = false;  ///< wanted only where no other holds nearby
};

/// Jaws: across cylinders and cones and along their axes, across pairs of parallel faces, in bores and slots. Three
/// jaws: along axes, on balls. Cups and magnets: on planes and on cylinders that are flat enough.
std::vector<Seed> seeds_of(const Part& part, const MeshTree& tree, const GripperShape& gripper,
                           const Vec3& mass_center_mm);

/// The taught points for a gripper, in all poses that the part's symmetry makes of them, tilted and turned as allowed.
std::vector<Seed> taught_seeds(const Part& part, const CellPart& cell, const std::string& gripper);

/// The TCP's pose with its tips beyond a point.
Pose tcp_at(const Vec3& at, const Vec3& closing, const Vec3& approach);

}  // namespace tribin::grasp
