#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

/// Where the bundle adjustment starts: closed forms of one device.
namespace tribin::calibration_detail {

/// The homography that maps board points (x, y in mm; z is not looked at) to pixels; none for fewer than 4 points or
/// points on a line. \param weights  empty: all equal. \source direct linear transform with Hartley's normalisation.
std::optional<Eigen::Matrix3d> homography_of(std::span<const Vec3> board, std::span<const Vec2> pixel,
                                             std::span<const double> weights = {});

/// The focal length [px] at which the board's axes come out square and equally long in all views, the principal point
/// being known; none where no view is tilted enough to say. \source Zhang 2000, with one unknown.
std::optional<double> focal_of(std::span<const Eigen::Matrix3d> homographies, const Vec2& principal);

/// camera_from_board of a homography.
Pose pose_of_homography(const Eigen::Matrix3d& homography, double focal, const Vec2& principal);

}  // namespace tribin::calibration_detail
