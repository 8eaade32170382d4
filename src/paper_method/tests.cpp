#include "tribin/paper_method/tests.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/paper_method/pose.hpp"

namespace tribin::paper {
namespace {

constexpr double kMaxTurnDeg = 3;  // a short strip holds its axis no better; see docs/segmentation.md

TestResult at_most(const char* test, double value, double limit) { return {test, value, limit, value <= limit}; }
TestResult at_least(const char* test, double value, double limit) { return {test, value, limit, value >= limit, true}; }

double angle_deg(const Vec3& a, const Vec3& b) { return std::acos(std::clamp(a.dot(b), -1.0, 1.0)) / kDegree; }

double sigma_of_place(const Primitive& p) { return std::sqrt(p.covariance(2, 2) + p.covariance(3, 3)); }

/// Distance of two axes: of parallel lines where they are parallel within 3 degrees, of skew lines else.
double axis_distance(const Primitive& a, const Primitive& b) {
  const Vec3 cross = a.axis.cross(b.axis);
  if (cross.norm() < std::sin(kMaxTurnDeg * kDegree)) return across(middle_of(a), middle_of(b), a.axis).norm();
  return std::abs((b.point - a.point).dot(cross.normalized()));
}

/// The gap between two supports, as the gap between their bounding spheres' axes segments less the radii.
double gap_between(const Primitive& a, const Primitive& b) {
  double best = 1e300;
  for (int i = 0; i <= 8; ++i)
    for (int j = 0; j <= 8; ++j) {
      const Vec3 p = a.point + a.axis * (a.extent_min + a.height_mm() * i / 8);
      const Vec3 q = b.point + b.axis * (b.extent_min + b.height_mm() * j / 8);
      const double along = std::abs((q - p).dot(a.axis)), aside = across(p, q, a.axis).norm();
      // Coaxial supports may be close end to end; others flank to flank.
      best = std::min(best, std::max(along - 1e-9, std::max(0.0, aside - a.radius_mm - b.radius_mm)));
    }
  return best;
}

}  // namespace

Vec3 middle_of(const Primitive& c) { return c.point + c.axis * (0.5 * (c.extent_min + c.extent_max)); }

TestResult cylinder_radius(const Primitive& seen, const Primitive& model) {
  return at_most("cylinder_radius", std::abs(seen.radius_mm - model.radius_mm),
                 5 * std::sqrt(seen.covariance(4, 4)) + 0.02 * model.radius_mm);
}

TestResult cylinder_height(const Primitive& seen, const Primitive& model) {
  return at_most("cylinder_height", std::abs(seen.height_mm() - model.height_mm()), 0.5 * model.height_mm());
}

TestResult largest_cylinder(const Primitive& model, double largest_radius_mm) {
  return at_most("largest_cylinder", largest_radius_mm - model.radius_mm, 0.02 * largest_radius_mm);
}

TestResult sub_cylinder(const Primitive& main, const Primitive& sub, double diameter_mm) {
  TestResult test = at_most("sub_cylinder", gap_between(main, sub), 0.1 * diameter_mm);
  test.passed = test.passed && sub.radius_mm < 0.98 * main.radius_mm;  // smaller by more than castings differ
  return test;
}

TestResult plane_on_cylinder(int seen) { return at_least("plane_on_cylinder", seen, 1); }

TestResult plane_to_cylinder(const Vec3& normal_seen, const Vec3& axis_seen, const Vec3& normal_model,
                             const Vec3& axis_model) {
  return at_most("plane_to_cylinder", std::abs(angle_deg(normal_seen, axis_seen) - angle_deg(normal_model, axis_model)),
                 kMaxTurnDeg);
}

TestResult superquadric(const Primitive& seen, const Surfels& surfels) {
  Vec3 u, v;
  orthonormal_basis(seen.axis, u, v);
  const Vec3 origin = middle_of(seen);
  double sum = 0;
  for (std::uint32_t i : seen.surfels) {
    const Vec3 d = surfels.position[i].cast<double>() - origin;
    sum += std::abs(superquadric_of_cylinder({d.dot(u), d.dot(v), d.dot(seen.axis)}, seen.radius_mm, seen.height_mm()) -
                    1);
  }
  const double mean = seen.surfels.empty() ? 1 : sum / static_cast<double>(seen.surfels.size());
  return at_most("superquadric", mean, std::pow(2.0, 0.05) - 1 + 3 * seen.rms_mm / seen.radius_mm);
}

TestResult intersected_planes(int seen, int model) { return at_most("intersected_planes", seen, model); }

TestResult area_similarity(const Primitive& plane_seen, const Primitive& cylinder_seen, const Primitive& plane_model,
                           const Primitive& cylinder_model) {
  const double whole = cylinder_seen.area_mm2 * std::max(1.0, cylinder_model.arc / std::max(1e-3, cylinder_seen.arc));
  const double seen = plane_seen.area_mm2 / std::max(1e-6, whole);
  const double model = plane_model.area_mm2 / std::max(1e-6, cylinder_model.area_mm2);
  // A face seen aslant behind its own rim keeps a fifth of itself in most views.
  return at_least("area_similarity", std::min(seen, model) / std::max({seen, model, 1e-12}), 0.2);
}

TestResult shared_planes(int seen, int model) { return at_most("shared_planes", seen, model); }

TestResult plane_plane_angle(const Vec3& first_seen, const Vec3& second_seen, const Vec3& first_model,
                             const Vec3& second_model) {
  return at_most("plane_plane_angle",
                 std::abs(angle_deg(first_seen, second_seen) - angle_deg(first_model, second_model)), kMaxTurnDeg);
}

TestResult cylinder_distance(const Primitive& main_seen, const Primitive& sub_seen, const Primitive& main_model,
                             const Primitive& sub_model, double diameter_mm) {
  return at_most("cylinder_distance",
                 std::abs(axis_distance(main_seen, sub_seen) - axis_distance(main_model, sub_model)),
                 5 * std::hypot(sigma_of_place(main_seen), sigma_of_place(sub_seen)) + 0.01 * diameter_mm);
}

TestResult cylinder_angle(const Primitive& main_seen, const Primitive& sub_seen, const Primitive& main_model,
                          const Primitive& sub_model) {
  const double seen = std::abs(main_seen.axis.dot(sub_seen.axis));
  const double model = std::abs(main_model.axis.dot(sub_model.axis));
  return at_most("cylinder_angle", std::abs(std::acos(std::min(1.0, seen)) - std::acos(std::min(1.0, model))) / kDegree,
                 kMaxTurnDeg);
}

}  // namespace tribin::paper
