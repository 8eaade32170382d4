#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tribin/segmentation/primitives.hpp"

namespace tribin::segmentation_detail {

using Indices = std::vector<std::uint32_t>;

/// A surface that distances can be measured to. One struct for all types: plane, or a surface of revolution.
struct Surface {
  PrimitiveType type = PrimitiveType::plane;
  Vec3 axis = Vec3::UnitZ();  ///< plane: normal on the side of the surfels' normals
  Vec3 point = Vec3::Zero();  ///< plane: on it; cylinder, cone: on the axis, where `radius` holds; else centre
  double radius = 0;          ///< mm
  double minor_radius = 0;    ///< torus: of the tube; `radius` is that of the circle it runs along
  double half_angle = 0;      ///< cone: the radius grows by tan(half_angle) along the axis [rad], any sign
  bool concave = false;

  /// Signed distance [mm]: geometric, along the surface's normal; > 0 outside of the radius or on the normal's side.
  double distance(const Vec3& p) const;
  /// Normal at the foot of p, on the side of the surfels' normals (towards the axis where concave).
  Vec3 normal(const Vec3& p) const;
};

/// The untrimmed surface of a primitive.
Surface surface_of(const Primitive& primitive);

/// How many numbers fix a surface of a type.
int parameters_of(PrimitiveType type);

/// The raw points behind a surfel that fits run on: the corrected mean of a scan's cell; the three vertices of a
/// triangle, which lie on the true surface where the facet does not. \return how many were written.
int raw_points(const Surfels& surfels, std::uint32_t i, Vec3 points[3]);

/// Signed distance of a surfel from a surface [mm]: of its raw point that is farthest off.
double misfit(const Surfels& surfels, std::uint32_t i, const Surface& surface);

/// Result of a fit.
struct Fit {
  Surface surface;
  Matrix6 covariance = Matrix6::Zero();  ///< order of Primitive::covariance
  double scale = 1;                      ///< robust size of the residuals in sigmas of a surfel, >= 1
  double rms_sigma = 0;                  ///< rms of the inliers' residuals in sigmas
  bool valid = false;
};

struct FitOptions {
  bool hold_radius = false;  ///< keep surface.radius
  bool hold_axis = false;    ///< keep the direction of surface.axis
  bool cone = false;         ///< let the half angle go
  double start_mm = 0;       ///< robust scale to start at, 0 = already close
  int max_surfels = 4000;    ///< fit every k-th beyond that
};

/// Least squares of a plane to the surfels' positions, robust, weights 1 / sigma^2.
Fit fit_plane(const Surfels& surfels, std::span<const std::uint32_t> support);

/// The largest curvature [1/mm] that the residuals about a plane could hide: |kappa| + 2 sd of the steepest direction
/// of a quadric fitted to them; infinite where the support is too small to say.
double curvature_bound(const Surfels& surfels, std::span<const std::uint32_t> support, const Fit& plane);

/// Levenberg-Marquardt on geometric distances to a cylinder, cone, sphere or torus with a Geman-McClure kernel that
/// shrinks from `start_mm` to the noise. \param start  a surface near the solution.
Fit fit_round(const Surfels& surfels, std::span<const std::uint32_t> support, const Surface& start,
              const FitOptions& options = {});

/// The last steps of a fit on the raw pixels behind a scan's surfels, because a cell's mean lies off a tight radius.
/// Moves fit.surface and renews its covariance; the residuals of the cells stay. \param label  of the surfels: pixels
/// of free cells beside the support that lie on the surface are fitted as well. \return false where it cannot.
bool refine_on_pixels(const Surfels& surfels, std::span<const std::uint32_t> support, const FitOptions& options,
                      std::span<const std::int32_t> label, Fit& fit);

/// The circle of revolution that normals across a known axis point at: centre and radius, closed form.
/// \return a cylinder; radius <= 0 where the normals do not meet.
Surface cylinder_from_normals(const Surfels& surfels, std::span<const std::uint32_t> support, const Vec3& axis);
/// The same in space, for a sphere.
Surface sphere_from_normals(const Surfels& surfels, std::span<const std::uint32_t> support);
/// A cone from the circle that its normals draw on the unit sphere, and the apex that their planes share.
Surface cone_from_normals(const Surfels& surfels, std::span<const std::uint32_t> support);

/// How many times fewer the data of a scan are than its cells, for their noise is correlated: >= 1.
double correlation_inflation(const Surfels& surfels);

/// A torus from its surfels' tighter curvature: one tube radius along the normals lie the points of a circle.
Surface torus_from_curvature(const Surfels& surfels, std::span<const std::uint32_t> support);
/// The same where the tube's radius is known [mm], < 0 seen from inside.
Surface torus_of_tube(const Surfels& surfels, std::span<const std::uint32_t> support, double tube);

/// Robust size of residuals in sigmas: 1.4826 MAD about 0, at least 1, at most what one raw point scatters.
double residual_scale(const Surfels& surfels, std::span<const std::uint32_t> support, const Surface& surface);

}  // namespace tribin::segmentation_detail
