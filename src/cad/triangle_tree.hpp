#pragma once

#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/box_tree.hpp"

namespace tribin {

/// Finds the triangles of a mesh that a ray crosses: a tree of boxes over its triangles. Refers to the mesh.
class TriangleTree {
 public:
  explicit TriangleTree(const Mesh& mesh);

  /// The triangles that origin + t * direction, t > 0, crosses; in no order. Replaces what `crossed` held.
  void cross(const Vec3& origin, const Vec3& direction, std::vector<std::uint32_t>& crossed) const;

 private:
  const Mesh& mesh_;
  BoxTree<Vec3f> tree_;
};

}  // namespace tribin
