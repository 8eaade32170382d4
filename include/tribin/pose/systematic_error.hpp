#pragma once

#include <span>
#include <vector>

#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"

// What errors that are common to many pixels do to a refined pose: pulls on it, whose sandwich with the inverse
// information, H^-1 P H^-1, is their part of the pose's covariance. Pulls are of the conjugates of (mm, rad about the
// centre), camera axes.
namespace tribin {

/// A piece of the seen surface, of like normals: its pixels share what mirrored light, burrs and the sensor's ripple
/// do.
struct ErrorPatch {
  Vector6 pull = Vector6::Zero();  ///< of an error of 1 mm along the normals
  double weight = 0;               ///< sum of 1 / sigma^2 over what tells of its own [1/mm^2]
  double residual_mm = 0;          ///< weighted mean of the scan's distance from the surface
  Vec2 place_mm = Vec2::Zero();    ///< in the image, at the part's depth
  double lateral_mm2 = 0;          ///< variance of what the camera is off sideways, along the normals
  int direction = 0;               ///< of the normals: equal for patches that may share more
};

struct CommonErrors {
  std::vector<ErrorPatch> patches;
  Matrix6 systematic = Matrix6::Zero();  ///< pull of what the noise profile states; 0 where it names no such error
};

/// The patches that hold the pose, some 36 times as many as directions of normals are in one place, and how the stated
/// errors of the sensor pull at them: the relative error of depth is taken as a quadratic over the image (coordinates
/// in [-1, 1]), of rms `noise.shape_error`, plus a scale of sd `noise.scale_error` and an offset of sd
/// `noise.offset_mm` for the whole scan.
/// \param render  of the part at the refined pose, as the refinement's last one.
/// \param center  in the camera frame; rotations turn about it, as in Refinement::information.
/// \cost about 30 ns a rendered pixel.
/// \source ours: J_s S_sys J_s^T of the design notes, section 9, with the sensor's smooth errors as parameters.
CommonErrors common_errors(const IndexRender& render, const SceneDepth& scene, const NoiseProfile& noise,
                           const Vec3& center, double cad_sigma_mm);

/// A variance and from how many patches it is known.
struct FieldVariance {
  double mm2 = 0;
  double patches = 0;  ///< less the directions that the fit took from them
};

/// Variance of what each patch is off by beyond its noise. The fit has moved the pose into a part of it, of small
/// patches that alone hold a direction all: what is left of the residuals is compared with what the fit leaves of a
/// field of variance 1.
/// \param held  covariance of (mm, rad about the centre) by noise alone, without free directions.
/// \source moments of projected residuals, as in MINQUE: C. R. Rao, "Estimation of variance and covariance components",
///         J. Multivariate Analysis 1, 1971; weights by its own answer, four times.
FieldVariance field_variance(std::span<const ErrorPatch> patches, const Matrix6& held, int held_directions);

/// Pull of such a field, of what the camera is off sideways, and of what each patch shows by itself.
/// \param correlation_mm  over which patches of one direction share what they are off by.
/// \source what patches show by themselves: the covariance of clustered observations (K.-Y. Liang, S. Zeger,
///         "Longitudinal data analysis using generalized linear models", Biometrika 73, 1986).
Matrix6 pull_of_field(std::span<const ErrorPatch> patches, double variance_mm2, double correlation_mm);

}  // namespace tribin
