#include "tribin/paper_method/pose.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/paper_method/tests.hpp"

namespace tribin::paper {

double superquadric_of_cylinder(const Vec3& p, double radius_mm, double height_mm) {
  constexpr double kE1 = 0.1;  // e1 -> 0 makes the rim sharp, and F overflow
  const double round = (p.x() * p.x() + p.y() * p.y()) / (radius_mm * radius_mm);
  const double z = 2 * p.z() / height_mm, along = z * z;
  // F^(e1/2) without the powers that overflow: (round^10 + along^10)^0.05 with the larger taken out.
  const double larger = std::max(round, along);
  if (!(larger > 0)) return 0;
  return std::sqrt(larger) * std::pow(std::pow(round / larger, 1 / kE1) + std::pow(along / larger, 1 / kE1), 0.5 * kE1);
}

Vec3 across(const Vec3& first, const Vec3& second, const Vec3& axis) {
  const Vec3 d = second - first;
  return d - axis * axis.dot(d);
}

TestResult axis_offset(const Primitive& main, const Primitive& sub) {
  const double place = main.covariance(2, 2) + main.covariance(3, 3) + sub.covariance(2, 2) + sub.covariance(3, 3);
  // The tilt of the main axis moves the foot of the sub-cylinder's middle by the distance along the axis.
  const double reach = (middle_of(sub) - middle_of(main)).dot(main.axis);
  const double tilt = main.covariance(0, 0) + main.covariance(1, 1);
  TestResult test{"axis_offset", across(middle_of(main), middle_of(sub), main.axis).norm(),
                  3 * std::sqrt(place + reach * reach * tilt), false, true};
  // Castings are coaxial within a hundredth of their size, not within the noise of a scan.
  test.limit = std::max(test.limit, 0.02 * main.radius_mm);
  test.passed = test.value > test.limit;
  return test;
}

Matrix3 frame_of(const Vec3& v1, const Vec3& v3) {
  const Vec3 third = (v3 - v1 * v1.dot(v3)).normalized();
  Matrix3 frame;
  frame.col(0) = v1;
  frame.col(1) = third.cross(v1);
  frame.col(2) = third;
  return frame;
}

std::array<Vec3, 4> intersection_points(const Primitive& cylinder, const Primitive& plane, const Matrix3& frame) {
  const Vec3 axis = frame.col(0), n = plane.axis;
  const double along = n.dot(axis);
  const double beyond = plane.offset_mm - n.dot(cylinder.point);  // of the plane, from the axis
  if (std::abs(along) < std::sin(10 * kDegree)) {
    // Below 10 degrees the plane leaves the cylinder's ends before it has crossed it: two lines along the axis.
    const Vec3 aside = axis.cross(n).normalized(), outwards = aside.cross(axis);
    const double half = std::sqrt(std::max(0.0, cylinder.radius_mm * cylinder.radius_mm - beyond * beyond));
    const double sense = cylinder.axis.dot(axis) < 0 ? -1 : 1;
    const double low = sense < 0 ? -cylinder.extent_max : cylinder.extent_min;
    const double high = sense < 0 ? -cylinder.extent_min : cylinder.extent_max;
    const Vec3 foot = cylinder.point + beyond * outwards;
    return {Vec3(foot - half * aside + low * axis), Vec3(foot - half * aside + high * axis),
            Vec3(foot + half * aside + low * axis), Vec3(foot + half * aside + high * axis)};
  }
  std::array<Vec3, 4> out;
  for (int k = 0; k < 4; ++k) {
    const Vec3 side = (k % 2 ? -1.0 : 1.0) * Vec3(frame.col(k < 2 ? 2 : 1));
    const Vec3 ruling = cylinder.point + cylinder.radius_mm * side;
    out[k] = ruling + axis * ((plane.offset_mm - n.dot(ruling)) / along);
  }
  return out;
}

Vec3 mean_shift(std::span<const Vec3> from, std::span<const Vec3> to) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) sum += to[i] - from[i];
  return from.empty() ? sum : Vec3(sum / static_cast<double>(from.size()));
}

Icp icp_translation(std::span<const Vec3f> seen, std::span<const Vec3f> model, const Matrix3& rotation,
                    const Vec3& start, int iterations) {
  Icp icp;
  icp.translation = start;
  if (seen.empty() || model.empty()) return icp;
  std::vector<Vec3f> turned;
  for (const Vec3f& q : model) turned.push_back((rotation * q.cast<double>()).cast<float>());
  for (;; ++icp.iterations) {
    Vec3 pull = Vec3::Zero();
    double weights = 0, sum = 0;
    for (const Vec3f& p : seen) {
      const Vec3f x = (p.cast<double>() - icp.translation).cast<float>();
      float best = 1e30f;
      const Vec3f* nearest = &turned[0];
      for (const Vec3f& q : turned) {
        const float dx = q.x() - x.x(), dy = q.y() - x.y(), dz = q.z() - x.z();
        const float d = dx * dx + dy * dy + dz * dz;
        if (d < best) best = d, nearest = &q;
      }
      const double distance = std::sqrt(static_cast<double>(best));
      sum += distance;
      // Weiszfeld's weights minimise the sum of distances; below 0.01 mm a pair is met and pulls no harder.
      const double w = 1 / std::max(distance, 0.01);
      pull += w * (x - *nearest).cast<double>();
      weights += w;
    }
    icp.mean_distance_mm = sum / static_cast<double>(seen.size());
    if (icp.iterations >= iterations) break;
    const Vec3 step = pull / weights;
    icp.translation += step;
    if (step.norm() < 1e-3) break;  // a micrometre is far below what nearest points can hold
  }
  icp.moved_mm = (icp.translation - start).norm();
  return icp;
}

TestResult icp_distance(double mean_distance_mm, double diameter_mm) {
  const double limit = 0.025 * diameter_mm;
  return {"icp_distance", mean_distance_mm, limit, mean_distance_mm <= limit};
}

}  // namespace tribin::paper
