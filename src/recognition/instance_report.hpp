#pragma once

#include "candidates.hpp"
#include "tribin/recognition/instance.hpp"

// What is said of an accepted pose: its covariance, what stays free or weak, and the evidence primitive by primitive.
namespace tribin {

/// Directions (mm, rad about the box centre, camera axes) along which the part's own symmetry leaves the pose free;
/// unit when radians count `part.gyration_mm`.
std::vector<Vector6> free_directions_about_center(const Part& part, const Pose& camera_from_part);

/// Covariance by noise alone of (mm, rad about the box centre), camera axes; 0 along free directions.
Matrix6 noise_covariance(const Part& part, const Refinement& refinement);

/// Fills covariance, free and weak directions.
/// \param common_pull  of what errors have in common (pose/systematic_error.hpp), at the refined pose.
void describe_uncertainty(const Part& part, const Matrix6& common_pull, const Refinement& refinement,
                          Instance& instance);

/// Mean square of how far the covariance lets a point of the part (camera frame) move, over all directions [mm^2].
double motion_variance(const Instance& instance, const Vec3& at);

/// Fills evidence and quality of all that was found: each primitive that enough pixels show measured free of its
/// nominal value, the dimensions between them, the surface point by point.
void describe_quality(std::span<const Part> parts, const SceneDepth& scene, const SceneFeatures& features,
                      const NoiseProfile& noise, Instances& found);

}  // namespace tribin
