#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tribin/core/geometry.hpp"

/// Where the camera stands to the robot, from pairs of a robot pose and what the camera saw of a target there.
namespace tribin {

enum class CameraMount {
  fixed,  ///< the camera stands in the cell, the target sits on the flange: gives base_from_camera
  hand    ///< the camera sits on the flange, the target lies in the cell: gives flange_from_camera
};

enum class HandEyeTarget {
  board,  ///< seen with position and rotation
  sphere  ///< only its centre is seen: the rotation of camera_from_target is not looked at
};

/// One stop of the robot.
struct HandEyePair {
  std::string id;
  Pose base_from_flange = Pose::Identity();
  Pose camera_from_target = Pose::Identity();
};

/// Standard deviations of one measured pose, each axis alike. Their ratios weigh the data; their common size is
/// estimated from it (HandEye::variance_factor).
struct HandEyeNoise {
  double robot_mm = 0.1;               ///< > 0
  double robot_rad = 0.006 * kDegree;  ///< > 0
  double camera_mm = 0.2;              ///< > 0
  double camera_rad = 0.03 * kDegree;  ///< > 0; not used for spheres
};

struct HandEyeOptions {
  CameraMount mount = CameraMount::fixed;
  HandEyeTarget target = HandEyeTarget::board;
  HandEyeNoise noise = {};
};

/// How one pair agrees with the result. Errors are of the target, as seen against as predicted, in the camera.
struct HandEyeResidual {
  bool used = true;  ///< false: an outlier, which has no share in the result
  double error_mm = 0;
  double error_rad = 0;    ///< 0 for spheres
  double deviation = 0;    ///< root of the mean square error in sigmas: near 1 for what fits
  double left_out_mm = 0;  ///< the error by a calibration without this pair
  double left_out_rad = 0;
  int fits_camera_of = -1;  ///< outliers: the pair whose camera pose fits this robot pose; -1 = none
};

struct HandEye {
  Pose parent_from_camera = Pose::Identity();  ///< base_from_camera (fixed) or flange_from_camera (hand)
  Pose holder_from_target =
      Pose::Identity();                  ///< flange_from_target (fixed) or base_from_target (hand); spheres: R = I
  Matrix6 covariance = Matrix6::Zero();  ///< of parent_from_camera: (dt mm, w rad), R_true = Exp(w) R, parent's axes
  double sigma_mm = 0;                   ///< root of the summed variances of the camera's position
  double sigma_rad = 0;                  ///< the same of its rotation
  double sigma_at_targets_mm = 0;        ///< of a point amid the targets that were seen: what picking feels
  double variance_factor = 1;            ///< mean square of the residuals in sigmas; the covariance is scaled by it
  double rms_mm = 0, rms_rad = 0;        ///< of the residuals of the pairs in use
  double left_out_rms_mm = 0, left_out_rms_rad = 0;  ///< leave-one-out, over the pairs in use
  double axis_spread_rad =
      0;  ///< how far the axes of the turns lie apart; 0 = parallel: the place along them is not held
  std::vector<HandEyeResidual> pairs;        ///< one for each pair, in the caller's order
  std::vector<int> outliers;                 ///< indices, rising
  std::vector<std::pair<int, int>> swapped;  ///< outliers whose camera poses belong to each other; first < second
  bool nearly_parallel_axes = false;         ///< axis_spread_rad is below kNearlyParallelAxes
  bool noisier_than_stated = false;          ///< the residuals stand out of the stated noise (chi-square at 0.1 %)
};

/// Along the common axis of the turns the error grows by 1 / sin(spread): four times the error across it.
inline constexpr double kNearlyParallelAxes = 15 * kDegree;
/// Below it that factor is above 57, so that no practical pose noise leaves a useful answer.
inline constexpr double kParallelAxes = 1 * kDegree;

/// The fewest pairs: boards 3 (two turns about different axes), spheres 5 (the linear start has 15 unknowns).
int fewest_pairs(HandEyeTarget target);

/// Hand-eye calibration: start from the consistent majority, then Gauss-Newton on all pairs that fit, both the robot's
/// and the camera's noise propagated into the residual (a turned flange moves the target by its lever).
/// \param pairs  in any order, ids unique; at least fewest_pairs. From 6 (spheres: 8) pairs up to 2 in 5 may be wrong.
/// \throws Error too_little_data for too few pairs, or turns about one axis only; bad_option for noise that is not > 0.
/// \cost         some milliseconds for 15 pairs.
/// \source       start: Park & Martin, "Robot sensor calibration: solving AX = XB on the Euclidean group", 1994, with
///               sine vectors in place of logarithms (ours: no jump at half turns); spheres: linear least squares.
///               Majority: least trimmed squares with concentration steps, Rousseeuw & Van Driessen 2006.
HandEye calibrate_hand_eye(std::span<const HandEyePair> pairs, const HandEyeOptions& options = {});

}  // namespace tribin
