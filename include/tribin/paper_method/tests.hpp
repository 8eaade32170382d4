#pragma once

#include "tribin/model/primitive_model.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin::paper {

// The tests of section IV-B, one function each, under the paper's names. "seen" is of the observation (the scan),
// "model" of the CAD. The paper gives no threshold; each limit has its reason here and in docs/paper_method.md.

/// M to N matching, r: |r_seen - r_model| [mm] within 5 sigma of the fit and 2 % of the radius (a casting).
TestResult cylinder_radius(const Primitive& seen, const Primitive& model);
/// M to N matching, h: |h_seen - h_model| [mm] within half of the model's height: a support ends at windows, edges and
/// shadows, and may lose that much before it is another cylinder's.
TestResult cylinder_height(const Primitive& seen, const Primitive& model);

/// Case 1, the cylinder of largest radius: how much smaller than the model's largest it is [mm], within 2 % of that.
TestResult largest_cylinder(const Primitive& model, double largest_radius_mm);
/// Case 2, the sub-cylinder: smaller, and "very close": the gap between both supports [mm] within 10 % of the diameter.
TestResult sub_cylinder(const Primitive& main, const Primitive& sub, double diameter_mm);
/// Case 3, planes intersected with a key cylinder: their number seen; at least 1 ("has at least one or more planes").
TestResult plane_on_cylinder(int seen);
/// Case 4, plane-to-cylinder relation of base sub-cylinder and plane: the difference [deg] of the angles between axis
/// and normal, within 3 deg.
/// \param axis_seen, axis_model  unit, turned to point the same way.
TestResult plane_to_cylinder(const Vec3& normal_seen, const Vec3& axis_seen, const Vec3& normal_model,
                             const Vec3& axis_model);

/// Equation (7) as mended: mean |F - 1| of the support's points about the ideal cylinder of the estimated radius.
/// Limit: what the rounded rim of e1 = 0.1 takes off an exact one (3.5 %), and 3 rms of the fit.
TestResult superquadric(const Primitive& seen, const Surfels& surfels);

/// Indicator 1, number of planes intersected with the key cylinders: seen against the model's. What is seen is included
/// in the model, so that it cannot be more.
TestResult intersected_planes(int seen, int model);
/// Indicator 2, area similarity of an intersected plane and its key cylinder: the ratio of the areas, seen against
/// model, as smaller over larger; at least 0.2. The seen cylinder's area is scaled from its arc to the model's.
TestResult area_similarity(const Primitive& plane_seen, const Primitive& cylinder_seen, const Primitive& plane_model,
                           const Primitive& cylinder_model);
/// Indicator 3, existence of planes shared by both key cylinders: seen against the model's, as included.
TestResult shared_planes(int seen, int model);
/// Further metric, angle between two planes: the difference [deg], within 3 deg.
TestResult plane_plane_angle(const Vec3& first_seen, const Vec3& second_seen, const Vec3& first_model,
                             const Vec3& second_model);
/// Further metric, distance between two cylinders: the difference of the distances of their axes [mm], within 5 sigma
/// and 1 % of the diameter.
TestResult cylinder_distance(const Primitive& main_seen, const Primitive& sub_seen, const Primitive& main_model,
                             const Primitive& sub_model, double diameter_mm);
/// "Ideally, these two vectors should be parallel": the difference of the angles between both axes [deg], within 3 deg.
TestResult cylinder_angle(const Primitive& main_seen, const Primitive& sub_seen, const Primitive& main_model,
                          const Primitive& sub_model);

/// Middle of a cylinder's support, on its axis [mm].
Vec3 middle_of(const Primitive& cylinder);

}  // namespace tribin::paper
