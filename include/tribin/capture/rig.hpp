#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tribin/core/camera.hpp"
#include "tribin/core/distortion.hpp"

namespace tribin {

/// A camera of a rig, or its projector, which is a camera that looks the other way.
struct RigCamera {
  std::string name;
  PinholeCamera camera;  ///< width and height may be 0: taken from the frames
  Distortion distortion{0, 0, 0, 0, 0};
  Pose rig_from_camera = Pose::Identity();
};

/// The cameras and the projector of a structured-light rig, fixed to each other.
struct Rig {
  std::vector<RigCamera> cameras;
  std::optional<RigCamera> projector;  ///< needed with one camera; two cameras measure without
  std::string source;                  ///< file name, for messages
};

/// The pixel at which a rig camera sees a point of the rig's frame (in front of it), distortion included.
Vec2 pixel_of(const RigCamera& camera, const Vec3& rig_point);

}  // namespace tribin
