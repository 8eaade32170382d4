#include <algorithm>
#include <cmath>

#include "tribin/grasp/candidates.hpp"

namespace tribin::grasp {
namespace {

Pose tcp_pose(const Vec3& at, const Vec3& closing, const Vec3& approach) {
  Pose pose = Pose::Identity();
  pose.linear().col(0) = closing;
  pose.linear().col(1) = approach.cross(closing);
  pose.linear().col(2) = approach;
  pose.translation() = at;
  return pose;
}

}  // namespace

GraspPart prepare_grasps(const Part& part, const CellPart& cell, std::span<const Gripper> grippers) {
  GraspPart out;
  out.part = &part;
  out.cell = cell;
  for (const Gripper& gripper : grippers) {
    const bool wanted = cell.grippers.empty() ||
                        std::find(cell.grippers.begin(), cell.grippers.end(), gripper.name) != cell.grippers.end();
    if (!wanted) continue;
    out.grippers.push_back(gripper_shape(gripper));
    const int g = static_cast<int>(out.grippers.size()) - 1;
    const GripperShape& shape = out.grippers.back();
    for (const PickPoint& point : cell.pick_points) {
      if (!point.gripper.empty() && point.gripper != gripper.name) continue;
      Candidate c;
      c.family = "taught " + point.name;
      c.gripper = g;
      c.part_from_tcp = point.part_from_tcp;
      c.opening_mm = shape.stroke_max();
      c.priority = point.priority;
      out.candidates.push_back(c);
    }
    if (!cell.pick_points.empty() || shape.jaws != 2) continue;
    for (const Primitive& p : part.model.primitives) {
      if (p.type != PrimitiveType::cylinder || p.concave) continue;
      Vec3 u, v;
      orthonormal_basis(p.axis, u, v);
      for (int k = 0; k < 24; ++k) {
        const double angle = k * 15 * kDegree;
        const Vec3 approach = std::cos(angle) * u + std::sin(angle) * v;
        Candidate c;
        c.family = "cylinder " + std::to_string(p.id) + " radial";
        c.gripper = g;
        c.part_from_tcp = tcp_pose(p.point, approach.cross(p.axis), approach);
        c.opening_mm = 2 * p.radius_mm;
        out.candidates.push_back(c);
      }
    }
  }
  return out;
}

}  // namespace tribin::grasp
