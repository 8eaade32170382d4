#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin::sim {

/// Signed distance to a part's surface on a grid: fine near the surface, coarse elsewhere. Negative inside. Part frame,
/// mm. Concave parts collide as they are: no convex pieces, and no limit on their number.
/// On the surface itself it reads 0 within half a cell at sharp edges, a twentieth of one in the mean.
class DistanceField {
 public:
  explicit DistanceField(const Mesh& mesh);

  /// Distance by trilinear interpolation; beyond the grid the distance to it is added.
  float at(const Vec3f& point) const;
  /// The same with its unit gradient, which points out of the part.
  float at(const Vec3f& point, Vec3f& gradient) const;
  /// A number that the true distance does not fall below. \cost one look-up
  float lower_bound(const Vec3f& point) const;
  /// Side of the fine cells [mm].
  float cell_mm() const { return cell_; }

 private:
  static constexpr int kBlock = 8;  ///< fine cells along a side of a coarse one
  float interpolated(const Vec3f& point, Vec3f* gradient) const;

  Vec3f origin_ = Vec3f::Zero();
  float cell_ = 0, coarse_ = 0;
  std::array<int, 3> cells_{};       ///< coarse cells along each axis
  std::vector<float> nodes_;         ///< of the coarse grid, (cells + 1) each way, x fastest
  std::vector<std::int32_t> block_;  ///< of each coarse cell: index of its fine nodes, -1 = none
  std::vector<float> fine_;          ///< 9^3 nodes a block
};

}  // namespace tribin::sim
