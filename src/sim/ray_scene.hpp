#pragma once

#include <memory>
#include <vector>

#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// Where a ray first meets a body.
struct Hit {
  int body = -1;  ///< index, -1 = nothing
  std::uint32_t triangle = 0;
  double t = 0;                ///< the point is origin + t direction; its z, for camera rays (direction z = 1)
  Vec3 normal = Vec3::Zero();  ///< unit, towards the camera
};

/// Bodies ready for ray casting, in the camera frame. Embree stays behind this class.
class RayScene {
 public:
  explicit RayScene(const std::vector<Body>& bodies);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// The first hit of a ray from the camera's centre; `ray` has z = 1.
  Hit first_hit(const Vec3& ray) const;
  /// The first hit of a ray that leaves a surface at `point`.
  Hit next_hit(const Vec3& point, const Vec3& direction) const;
  /// Is anything between the point and `eye`?
  bool occluded(const Vec3& point, const Vec3& eye) const;

 private:
  Hit hit(const Vec3& origin, const Vec3& direction, double nearest) const;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tribin::sim
