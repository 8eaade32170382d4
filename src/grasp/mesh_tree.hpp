#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/box_tree.hpp"
#include "tribin/grasp/convex.hpp"

namespace tribin::grasp {

struct MeshHit {
  double t = 0;  ///< along the ray [mm]
  std::uint32_t triangle = 0;
};

/// A mesh's triangles under a tree of boxes: rays and gaps. Keeps what it needs of the mesh.
class MeshTree {
 public:
  explicit MeshTree(const Mesh& mesh);

  /// The first triangle that a ray meets within `reach`. \param direction  unit
  std::optional<MeshHit> first_hit(const Vec3& origin, const Vec3& direction, double reach) const;

  /// The gap between a body (mesh's frame) and the surface, as far as `enough` [mm]; 0 where they cross.
  double gap_mm(const Convex& body, double enough) const;

  /// Whether a point lies inside of the closed surface (as seen along one ray: by the side of the face it meets).
  bool inside(const Vec3& point) const;

  /// Unit, outward; zero for triangles without area.
  const Vec3& normal(std::uint32_t triangle) const { return normals_[triangle]; }
  const std::array<Vec3, 3>& corners(std::uint32_t triangle) const { return corners_[triangle]; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(corners_.size()); }

 private:
  using Node = BoxTree<Vec3>::Node;
  double triangle_gap(std::uint32_t triangle, const Convex& body, double enough) const;

  std::vector<std::array<Vec3, 3>> corners_;
  std::vector<Vec3> normals_;
  BoxTree<Vec3> tree_;
};

}  // namespace tribin::grasp
