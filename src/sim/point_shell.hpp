#pragma once

#include <cstdint>
#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin::sim {

/// Points spread over a part's surface, dense along sharp edges, in a tree of spheres. Part frame, mm.
struct PointShell {
  /// A sphere around points [first, last); inner nodes have two children, `child` and `child` + 1.
  struct Node {
    Vec3f centre = Vec3f::Zero();
    float radius = 0;
    std::int32_t first = 0, last = 0;
    std::int32_t child = -1;  ///< -1 = a leaf
  };
  std::vector<Vec3f> points;
  std::vector<Node> nodes;  ///< the root first
};

/// Spacing 1/64 of the diameter on faces (a round of radius R between two points stands out by spacing^2 / 8 R), a
/// third of it along edges of more than 20 degrees, whose crossings with other edges no face point sees.
PointShell make_point_shell(const Mesh& mesh);

}  // namespace tribin::sim
