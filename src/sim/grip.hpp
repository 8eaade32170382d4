#pragma once

#include <string>

#include "tribin/grasp/gripper_shape.hpp"
#include "tribin/sim/bin_scene.hpp"

namespace tribin::sim {

/// What closing a gripper, or switching its vacuum on, does to one part.
struct Grip {
  bool holds = false;
  bool touches = false;            ///< something of the part is between the jaws, or under the cup
  std::string why;                 ///< it does not hold
  Pose motion = Pose::Identity();  ///< of the part, frame of the TCP: jaws centre and align it, cups draw it near
  double opening_mm = 0;           ///< of the jaws, then
};

/// Jaws close on what lies between their pads; two of them turn the part as long as that lets them close further. It
/// holds where each jaw touches, the line between two contacts lies in the friction cones of both (a contact's normal
/// is the jaw's way where the flat of the pad meets the part, and the face's where the rim meets one that rises beyond
/// it), the width is within the stroke, and the force carries the part. A cup holds where its rim is tight: the surface
/// under it varies by 1 mm at most. \param opening_mm  before it closes \param mass_kg     0 = not known: force is not
/// asked for
Grip close_gripper(const grasp::GripperShape& gripper, double opening_mm, const Solid& part, const Pose& tcp_from_part,
                   double friction, double mass_kg);

}  // namespace tribin::sim
