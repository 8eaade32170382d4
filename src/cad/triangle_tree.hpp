#pragma once

#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin {

/// Finds the triangles of a mesh that a ray crosses: a tree of boxes over its triangles. Refers to the mesh.
class TriangleTree {
 public:
  explicit TriangleTree(const Mesh& mesh);

  /// The triangles that origin + t * direction, t > 0, crosses; in no order. Replaces what `crossed` held.
  void cross(const Vec3& origin, const Vec3& direction, std::vector<std::uint32_t>& crossed) const;

 private:
  struct Node {
    Vec3f low, high;
    std::uint32_t begin = 0, end = 0;  ///< range in order_ of a leaf
    std::uint32_t right = 0;           ///< the second child; the first follows its parent; 0 = leaf
  };

  std::uint32_t build(std::uint32_t begin, std::uint32_t end, const std::vector<Vec3f>& centers);

  const Mesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace tribin
