#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "tribin/pose/systematic_terms.hpp"
#include "tribin/segmentation/primitives.hpp"

// Metrology of one surface: a primitive fitted to raw points with all of its own parameters free.
namespace tribin {

/// A measured point that the part's pose says to be of a surface.
struct SurfacePoint {
  Eigen::Vector3d ray;  ///< z = 1
  double z_mm = 0;
  double sigma_z_mm = 0;
  std::array<double, kSystematicTerms> terms{};  ///< what the sensor's smooth errors do to z
  int i = 0, j = 0;                              ///< place in the render: patches are squares there
};

/// Parameters as of Primitive::covariance: tilt about u, tilt about v, shift along u, along v, radius, half angle; a
/// plane has its offset in place 2, a sphere its centre in 0-2, a cone the shift of its apex along the axis in 4.
struct FreeFit {
  Primitive nominal;   ///< as given, its point moved along the surface or axis to the middle of what is seen
  Primitive measured;  ///< camera frame; `point` in the middle of what is seen, `arc` seen, `points` that hold it
  Matrix6 covariance = Matrix6::Zero();  ///< noise, its correlation, what patches have in common; no systematic terms
  Eigen::Matrix<double, 6, kSystematicTerms> response;  ///< of the parameters to the systematic terms
  int patches = 0;                                      ///< that the covariance was counted over
  double rms_sigma = 0;                                 ///< of the residuals in sigmas: 1 when the noise explains them
  std::vector<bool> held_by;                            ///< of each point: does it hold the fit?
};

struct FreeFitOptions {
  double reach_mm = 0;      ///< points farther than 5 sigma and this from the nominal surface are of another one
  double cad_sigma_mm = 0;  ///< how far the part may be from its CAD (chord error of its facets)
  double independent = 1;   ///< share of the points that tell something of their own (noise correlation)
};

/// Below this arc the data cannot tell the radius from the place of the axis: it is held at its nominal value.
/// \source design notes: at 0.3 mm of noise an arc of 60 deg leaves the radius 0.4 mm of sd.
constexpr double kLeastArc = kPi / 3;

/// The primitive in another frame: axis, point and offset.
Primitive in_frame(const Primitive& primitive, const Pose& b_from_a);

/// The primitive with its k-th parameter moved by h [mm or rad].
Primitive nudged(const Primitive& primitive, int k, double h);

/// Of a point from the surface, outward positive [mm]; 0 where there is no outward (on an axis), and for tori.
double distance_from(const Primitive& surface, const Vec3& point);

/// Fits a primitive to points near its nominal place by Gauss-Newton on geometric residuals.
/// \param nominal  camera frame.
/// \return none where fewer than 40 points hold it, or for tori.
/// \source sandwich of clustered observations: Liang and Zeger, as in pose/systematic_error.hpp.
std::optional<FreeFit> fit_freely(const Primitive& nominal, std::span<const SurfacePoint> points,
                                  const FreeFitOptions& options);

}  // namespace tribin
