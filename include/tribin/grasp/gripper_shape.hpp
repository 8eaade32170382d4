#pragma once

#include <vector>

#include "tribin/config/work_cell.hpp"
#include "tribin/grasp/convex.hpp"

/// A gripper as bodies that move with its opening. Frame of the TCP: z out of the tool, towards the part; jaws close
/// along x (three jaws: towards z, the first along x).
namespace tribin::grasp {

/// A piece of a gripper.
struct GripperPiece {
  Convex body;                 ///< TCP frame, at opening 0
  Vec3 travel = Vec3::Zero();  ///< by which it moves for each mm of opening
  bool jaw = false;            ///< touches the part
};

/// Where a jaw touches: a flat rectangle. A cup or magnet: a disc in the plane z = 0.
struct Pad {
  double width_mm = 0;   ///< across (y)
  double length_mm = 0;  ///< along z, back from the tip
  double tip_mm = 0;     ///< z of the tip: how far the jaws reach beyond the TCP
};

struct GripperShape {
  Gripper gripper;  ///< as the cell has it
  std::vector<GripperPiece> pieces;
  Pad pad;
  double cup_mm = 0;    ///< radius of a cup or magnet
  int jaws = 0;         ///< 2, 3, or 0 for cups and magnets
  bool inside = false;  ///< jaws spread in a hole; the opening is measured over their outer faces
  std::vector<std::string> warnings;

  double stroke_min() const { return gripper.stroke_mm[0]; }
  double stroke_max() const { return gripper.stroke_mm[1]; }
};

/// What a gripper's description means as bodies. Jaws are, in this order: `finger_mm`, where given; boxes and cylinders
/// that reach to the TCP: one across the closing axis is the closed pair and is cut in two, a pair beside it has the
/// opening that it is drawn with; else fingers a quarter as thick and wide as they are long, from the body to the TCP.
/// \throws Error bad_input (naming the gripper) for a cup or magnet whose radius is neither given nor drawn.
GripperShape gripper_shape(const Gripper& gripper);

/// The pieces at an opening, TCP frame.
std::vector<Convex> pieces_at(const GripperShape& shape, double opening_mm);

}  // namespace tribin::grasp
