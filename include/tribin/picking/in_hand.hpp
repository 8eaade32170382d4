#pragma once

#include <span>
#include <vector>

#include "tribin/config/work_cell.hpp"

/// How a part is held: what the grip implies, and what scans of the part in the hand measure, put together by what is
/// known of their errors. Base frame, unless a name says otherwise; the sd of a place is that of its 3-D norm, as in
/// the work cell's file.
namespace tribin::picking {

inline constexpr double kSlipTurn = 0.3 * kDegree;  ///< sd of how a part turns while it is gripped and let go

/// How a part is held.
struct HeldPose {
  Pose tcp_from_part = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< of (dt in mm, w in rad about the middle of its box), axes of the TCP
  double chi2 = 0;  ///< how far looks and grip are apart, in sigmas, squared: six of them a look are to be expected
  double sigma_mm() const;  ///< of the place of its middle
};

/// What the grip implies: the part was where the scan showed it, the tool where it was sent, and then it slipped.
struct Grip {
  const Gripper* gripper = nullptr;
  Pose base_from_tcp = Pose::Identity();  ///< as it closed
  Pose tcp_from_part = Pose::Identity();  ///< as it was planned
  Matrix6 covariance = Matrix6::Zero();   ///< of the part's pose before, as PartHere::covariance
  bool seen = true;                       ///< by the camera; false: it stood where the arm had put it
};

/// A scan of the part in the hand.
struct HandLook {
  Pose base_from_tcp = Pose::Identity();   ///< as it was sent there
  Pose base_from_part = Pose::Identity();  ///< as it was measured
  Matrix6 covariance = Matrix6::Zero();    ///< as PartHere::covariance
  std::vector<Vector6> free_directions;    ///< (mm, rad about the part's origin), base's axes: they tell nothing
};

/// Of a part that was gripped, carried and let go since it was seen: of its pose, as PartHere::covariance.
Matrix6 covariance_of_standing(const WorkCell& cell);

/// The likeliest way in which the part is held, by least squares over what both know.
///
/// Hand-eye is off by the same motion at the bin and at the looks, the robot by one shift at all looks (they are near
/// each other) and another one at the bin. Jaws centre the part: along their travel, errors of pose, hand-eye and robot
/// at the bin are gone, and only slip is left.
/// \param camera_at     where the camera's centre stands: hand-eye turns about it
/// \param middle        of the part's box, part frame: covariances are about it
/// \param robot_mm      sd of where the arm stands
/// \param believe_grip  false: the looks alone, where they contradict it
HeldPose held_pose(const Grip& grip, std::span<const HandLook> looks, const CellHandEye& hand_eye,
                   const Vec3& camera_at, const Vec3& middle, double robot_mm, bool believe_grip = true);

}  // namespace tribin::picking
