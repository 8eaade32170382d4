#pragma once

#include <memory>

#include "tribin/cad/mesh.hpp"

namespace tribin::sim {

/// Exact distances to a mesh, by Embree's closest-point query. The mesh must outlive it.
class MeshDistance {
 public:
  explicit MeshDistance(const Mesh& mesh);
  ~MeshDistance();
  MeshDistance(const MeshDistance&) = delete;
  MeshDistance& operator=(const MeshDistance&) = delete;

  /// Distance of a point from the surface [mm], negative inside. Clipped at `limit` (sign unknown there: positive).
  /// \source sign by angle-weighted pseudo-normals: Baerentzen and Aanaes, IEEE TVCG 2005.
  double signed_distance(const Vec3& point, double limit = 1e30) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tribin::sim
