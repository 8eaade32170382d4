#pragma once

#include <limits>
#include <vector>

#include "tribin/core/geometry.hpp"

/// Grasps: how a gripper may take a found part, and why not.
namespace tribin::grasp {

/// A convex body: the sum of a box, a disc across z and a ball, swept along a straight line. With the right ones at 0
/// it is a box, a cylinder, a capsule or a ball; swept, it is all that such a body passes through on a straight move.
struct Convex {
  Pose frame_from_body = Pose::Identity();
  Vec3 half_mm = Vec3::Zero();   ///< half sides of the box
  double disc_mm = 0;            ///< radius of the disc
  double radius_mm = 0;          ///< of the ball
  Vec3 sweep_mm = Vec3::Zero();  ///< frame: from where the body stands to where it goes
};

Convex make_box(const Pose& frame_from_box, const Vec3& size_mm);
/// \param axis  unit
Convex make_cylinder(const Vec3& center_mm, const Vec3& axis, double radius_mm, double height_mm);
Convex make_capsule(const Vec3& from_mm, const Vec3& to_mm, double radius_mm);

/// The body seen from another frame.
Convex moved(const Pose& b_from_a, const Convex& in_a);

/// The point of the body that lies farthest along a direction, without its ball.
Vec3 support(const Convex& body, const Vec3& direction);
/// How far the body reaches along a unit direction, its ball included [mm].
double reach_along(const Convex& body, const Vec3& unit);

/// The gap between two bodies [mm]; 0 where they overlap. \param enough  a gap above it need not be exact: some number
/// between it and the gap is given. \cost 0.2 to 1 us, far bodies less
double distance_mm(const Convex& a, const Convex& b, double enough = std::numeric_limits<double>::infinity());

}  // namespace tribin::grasp
