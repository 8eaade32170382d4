#pragma once

#include "candidates.hpp"
#include "tribin/recognition/instance.hpp"

// What is said of an accepted pose: its covariance, what stays free or weak, and the evidence primitive by primitive.
namespace tribin {

/// Directions (mm, rad about the box centre, camera axes) along which the part's own symmetry leaves the pose free;
/// unit when radians count `part.gyration_mm`.
std::vector<Vector6> free_directions_about_center(const Part& part, const Pose& camera_from_part);

/// Fills covariance, free and weak directions from the information of the final refinement.
/// \param systematic_pull  from pull_of_systematic_errors, at the refined pose.
/// \param patch_pull       from pull_of_patches, the same.
void describe_uncertainty(const Part& part, const Matrix6& systematic_pull, const Matrix6& patch_pull,
                          const Refinement& refinement, Instance& instance);

/// Mean square of how far the covariance lets a point of the part (camera frame) move, over all directions [mm^2].
double motion_variance(const Instance& instance, const Vec3& at);

/// Fills evidence and quality of all that was found: each primitive that enough pixels show measured free of its
/// nominal value, the dimensions between them, the surface point by point.
void describe_quality(std::span<const Part> parts, const SceneDepth& scene, const SceneFeatures& features,
                      const NoiseProfile& noise, Instances& found);

}  // namespace tribin
