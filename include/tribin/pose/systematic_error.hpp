#pragma once

#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// What errors of the sensor that are common to many pixels do to a refined pose: the covariance of the pull on it,
/// B S B^T, whose sandwich with the inverse information, H^-1 (B S B^T) H^-1, is the covariance of the pose.
///
/// The relative error of depth is taken as a quadratic over the image (coordinates in [-1, 1]), of rms
/// `noise.shape_error`, plus a scale of sd `noise.scale_error` and an offset of sd `noise.offset_mm` for the whole
/// scan.
///
/// \param render  of the part at the refined pose, as the refinement's last one.
/// \param center  in the camera frame; rotations turn about it, as in Refinement::information.
/// \return of the conjugates of (mm, rad about the centre), camera axes; 0 where the profile names no such error.
/// \cost about 20 ns a rendered pixel.
/// \source ours: J_s S_sys J_s^T of the design notes, section 9, with the sensor's smooth errors as parameters.
Matrix6 pull_of_systematic_errors(const IndexRender& render, const SceneDepth& scene, const NoiseProfile& noise,
                                  const Vec3& center, double cad_sigma_mm);

/// How the pixels of whole patches pull at a pose that is at rest: the sum over some 25 patches of g g^T, where g is
/// the sum of J^T r / sigma^2 over a patch. For independent noise it is the information of the surface itself; mirrored
/// light, burrs and the sensor's ripple, which no number of pixels averages away, make it more.
/// \param render, center  as above.
/// \return 0 where there are fewer than 12 patches.
/// \source the covariance of clustered observations (K.-Y. Liang, S. Zeger, "Longitudinal data analysis using
///         generalized linear models", Biometrika 73, 1986), with n / (n - 6) for few clusters.
Matrix6 pull_of_patches(const IndexRender& render, const SceneDepth& scene, const Vec3& center, double cad_sigma_mm);

}  // namespace tribin
