#pragma once

#include <optional>

#include "mesh_tree.hpp"
#include "tribin/grasp/candidates.hpp"

// Where a gripper touches a part when it closes.
namespace tribin::grasp {

struct Contacts {
  Pose part_from_tcp = Pose::Identity();  ///< moved so that all jaws touch at the same opening
  double opening_mm = 0;
  double share = 0;            ///< of a cup's disc that touches
  double area_mm2 = 0;         ///< of the smallest of the jaws' contacts
  double friction_angle = 0;   ///< [rad] worst between the line of the contacts and their normals
  Vec3 center = Vec3::Zero();  ///< of the contacts, part frame
};

/// Closes jaws onto a part (inside: spreads them). \return none where a jaw meets nothing within its stroke, or three
/// jaws would have to move the part by more than 2 mm
/// \param finely  false: by a few rays, for a first look
std::optional<Contacts> close_jaws(const MeshTree& tree, const GripperShape& gripper, const Pose& part_from_tcp,
                                   bool finely = true);

/// The opening at which jaws just touch, from one at which rays said they do: between rays the part may rise.
/// \return none where it rises by more than 2 mm: the contacts are others
std::optional<double> exact_opening(const MeshTree& tree, const GripperShape& gripper, const Pose& part_from_tcp,
                                    double opening_mm);

/// Sets a cup or magnet on a part. \return none where nothing lies under its middle
std::optional<Contacts> set_cup(const MeshTree& tree, const GripperShape& gripper, const Pose& part_from_tcp);

/// Whether the open gripper comes to its place along z without touching the part.
/// \param way_mm  from where it comes
bool comes_free(const MeshTree& tree, const GripperShape& gripper, const Pose& part_from_tcp, double opening_mm,
                double way_mm, double gap_mm);

}  // namespace tribin::grasp
