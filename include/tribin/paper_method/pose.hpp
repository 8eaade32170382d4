#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "tribin/model/primitive_model.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin::paper {

/// Equation (7), mended: F^(e1 / 2) with F = ((x/r)^2 + (y/r)^2)^(1/e1) + (2z/h)^(2/e1), e1 = 0.1, e2 = 1; 1 on the
/// ideal cylinder, more outside. \param p  in the cylinder's frame: z along the axis, origin at mid-height [mm].
double superquadric_of_cylinder(const Vec3& p, double radius_mm, double height_mm);

/// The part of (second - first) that is perpendicular to the axis [mm]: v3 before it is normalised.
Vec3 across(const Vec3& first, const Vec3& second, const Vec3& axis);

/// v3's length [mm] against 3 sigma of it: below, the two are coaxial and fix no spin. \source IV-C, mended.
TestResult axis_offset(const Primitive& main, const Primitive& sub);

/// R = [v1 v2 v3] with v2 = v3 x v1. \param v3  any length, across v1. \source IV-C.
Matrix3 frame_of(const Vec3& v1, const Vec3& v3);

/// p1 to p4, where a plane meets a cylinder. A plane along the axis cuts it in the lines l1 and l2, whose four ends
/// they are; any other plane is met by the four rulings at +-v3 (on l1) and +-v2 (on l2). \source IV-C; figure 3.
/// \param frame  [v1 v2 v3] of the same side, v1 along the cylinder's axis.
std::array<Vec3, 4> intersection_points(const Primitive& cylinder, const Primitive& plane, const Matrix3& frame);

/// The shift that carries points p (turned already) to q with the least sum of squares: the mean difference.
Vec3 mean_shift(std::span<const Vec3> from, std::span<const Vec3> to);

/// Equation (8) as printed: the sum of distances (not of their squares) between each seen point and the model's
/// nearest, minimised over the translation alone, for "we estimate the rotation matrix and the translation vector
/// independently".
struct Icp {
  Vec3 translation = Vec3::Zero();
  double mean_distance_mm = 0;
  double moved_mm = 0;  ///< from the start
  int iterations = 0;
};
/// \param seen   camera frame. \param model  part frame. \param iterations  0 = only the distance at the start.
Icp icp_translation(std::span<const Vec3f> seen, std::span<const Vec3f> model, const Matrix3& rotation,
                    const Vec3& start, int iterations);

/// Equation (8)'s mean [mm], within 2.5 % of the diameter: half of what an answer may be off to count as found.
TestResult icp_distance(double mean_distance_mm, double diameter_mm);

}  // namespace tribin::paper
