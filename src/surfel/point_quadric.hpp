#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin::surfel_detail {

/// A quadric height field over the tangent plane of a window of loose points:
/// z = c0 + c1 x + c2 y + c3 x^2 + c4 x y + c5 y^2 [mm] in the frame (u, v, normal) at `origin`.
struct PointQuadric {
  Vec3 origin = Vec3::Zero();
  Vec3 u = Vec3::UnitX(), v = Vec3::UnitY(), normal = Vec3::UnitZ();
  std::array<double, 6> c{};
  std::array<double, 3> variance_slope{};     ///< of (c1, c1 c2, c2) for unit noise of one point
  Matrix3 variance_square = Matrix3::Zero();  ///< of (c3, c4, c5)
  double residual_mm = 0;                     ///< sd of one point about the quadric, degrees of freedom taken off
  double reach_mm = 0;                        ///< radius of the window
  int points = 0;                             ///< in the window; 0 = no fit

  bool valid() const { return points > 0; }
  /// Height of a point over the quadric [mm].
  double misfit(const Vec3& p) const;
  /// Unit normal at the foot of a point.
  Vec3 normal_at(const Vec3& p) const;
};

/// Principal curvatures at the origin, |k1| >= |k2|, > 0 where the surface bends away from the normal; sigma of k1 for
/// unit noise of one point.
struct PointCurvature {
  double k1 = 0, k2 = 0, unit_sigma = 0;
  Vec3 direction2 = Vec3::UnitX();
};
PointCurvature curvature_of(const PointQuadric& q);

/// Least squares to the window's points about its first one; the frame is turned once to the fitted normal.
/// \return an invalid one where the points lie on a line or leave no degrees of freedom.
PointQuadric fit_point_quadric(std::span<const Vec3f> points, std::span<const std::uint32_t> window);
/// The same with a plane: the coefficients of second degree are 0 and their variance is not known.
PointQuadric fit_point_plane(std::span<const Vec3f> points, std::span<const std::uint32_t> window);

}  // namespace tribin::surfel_detail
