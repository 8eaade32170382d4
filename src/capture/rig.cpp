#include "tribin/capture/rig.hpp"

namespace tribin {

Vec2 pixel_of(const RigCamera& c, const Vec3& rig_point) {
  const Vec3 p = c.rig_from_camera.inverse() * rig_point;
  const Vec2 q = distorted(c.distortion, {p.x() / p.z(), p.y() / p.z()});
  return {c.camera.fx * q.x() + c.camera.cx, c.camera.fy * q.y() + c.camera.cy};
}

}  // namespace tribin
