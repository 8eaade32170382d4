#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tribin/grasp/gripper_shape.hpp"
#include "tribin/part/part.hpp"

/// How a part alone may be gripped: found once per part, from its surfaces or from taught points.
namespace tribin::grasp {

class MeshTree;

/// One way to hold a part. Nothing is known of the scene yet.
struct Candidate {
  std::string family;  ///< e.g. "cylinder 3 radial", "planes 2 and 5", "plane 4 cup", "taught lug"
  int gripper = 0;     ///< index into GraspPart::grippers
  Pose part_from_tcp = Pose::Identity();
  double opening_mm = 0;      ///< of the jaws where they touch; 0 for cups and magnets
  double contact = 1;         ///< how well the jaws (cups: their disc) touch, (0, 1]
  double friction_angle = 0;  ///< [rad] worst between the line of the contacts and their normals
  double offset_mm = 0;       ///< of the mass centre from the line (cups: axis) that holds
  double priority = 1;        ///< taught points
};

/// A part with its candidates.
struct GraspPart {
  const Part* part = nullptr;
  CellPart cell;                         ///< mass, tilt, taught points
  std::vector<GripperShape> grippers;    ///< those that may hold it, in the order of CellPart::grippers
  std::vector<Candidate> candidates;     ///< best first within each gripper
  std::vector<std::string> warnings;     ///< e.g. a gripper that fits nowhere, and why
  Vec3 mass_center_mm = Vec3::Zero();    ///< part frame
  std::shared_ptr<const MeshTree> tree;  ///< of the part's triangles
};

/// Finds the grasps of a part. Without pick points: radial and end grasps on cylinders, pairs of parallel planes, bores
/// and slots from inside, cups and magnets on surfaces that are flat enough. Each is tried on the triangles: contacts
/// lie in the friction cones of each other, and the open gripper touches nothing of the part on its way in.
/// \param part      must outlive the answer.
/// \param grippers  of the cell; those named in `cell.grippers` are used, all where it names none.
/// \throws Error    bad_input as gripper_shape.
/// \cost            some 10 us a candidate that is looked at, once a part
GraspPart prepare_grasps(const Part& part, const CellPart& cell, std::span<const Gripper> grippers);

}  // namespace tribin::grasp
