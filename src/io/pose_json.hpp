#pragma once

#include "io/json_fields.hpp"
#include "tribin/core/geometry.hpp"
#include "tribin/kinematics/rotation_conventions.hpp"

namespace tribin::io {

// Poses in JSON. All throw bad_input with the place.

/// {"rotation" (3 x 3) | "rotation_vector_rad", "translation_mm"}
Pose pose_of(const JsonPlace& object);
nlohmann::ordered_json json_of(const Pose& pose);

/// The name of a maker's convention.
robot::Convention convention_of(const JsonPlace& place);
/// The numbers of a pose as that maker's controller shows them.
Pose robot_pose_of(const JsonPlace& numbers, robot::Convention convention);

}  // namespace tribin::io
