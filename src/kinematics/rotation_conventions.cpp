#include "tribin/kinematics/rotation_conventions.hpp"

#include <cmath>

#include "tribin/core/error.hpp"

namespace tribin::robot {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

// Below this sine the outer axes count as one: the spec's own threshold of 1e-6 would cost 3e-6 rad.
constexpr double kLock = 1e-9;

Matrix3 about(const Vector3d& axis, double degrees) { return AngleAxisd(degrees * kDegree, axis).toRotationMatrix(); }
Matrix3 about_x(double degrees) { return about(Vector3d::UnitX(), degrees); }
Matrix3 about_y(double degrees) { return about(Vector3d::UnitY(), degrees); }
Matrix3 about_z(double degrees) { return about(Vector3d::UnitZ(), degrees); }

/// atan2 in degrees, -180 turned into 180, so that one rotation has one set of numbers.
double atan2_deg(double sine, double cosine) {
  const double degrees = std::atan2(sine, cosine) / kDegree;
  return degrees <= -180 ? 180.0 : degrees + 0.0;
}

Eigen::Quaterniond quaternion_from_rotation(const Matrix3& rotation) {
  Eigen::Quaterniond q{Eigen::Matrix3d(rotation)};
  q.normalize();
  const Eigen::Vector4d order(q.w(), q.x(), q.y(), q.z());
  for (int i = 0; i < 4; ++i) {  // q and -q are one rotation: the first number that is not 0 is positive
    if (order[i] == 0) continue;
    if (order[i] < 0) q.coeffs() = -q.coeffs();
    break;
  }
  return q;
}

}  // namespace

Matrix3 rotation_from_yaskawa(const Vec3& a) { return about_z(a.z()) * about_y(a.y()) * about_x(a.x()); }

Vec3 yaskawa_from_rotation(const Matrix3& r) {
  const double cosine = std::hypot(r(0, 0), r(1, 0));
  if (cosine < kLock) return {0, atan2_deg(-r(2, 0), cosine), atan2_deg(-r(0, 1), r(1, 1))};
  const double c = r(0, 0) / cosine, s = r(1, 0) / cosine;
  // Rx from Rz(-Rz) R, not from r32 and r33: near the lock these are small, and what Rz lacks must go into Rx.
  return {atan2_deg(s * r(0, 2) - c * r(1, 2), c * r(1, 1) - s * r(0, 1)), atan2_deg(-r(2, 0), cosine),
          atan2_deg(s, c)};
}

Matrix3 rotation_from_fanuc(const Vec3& w_p_r) { return rotation_from_yaskawa(w_p_r); }
Vec3 fanuc_from_rotation(const Matrix3& rotation) { return yaskawa_from_rotation(rotation); }

Matrix3 rotation_from_kuka(const Vec3& a_b_c) { return rotation_from_yaskawa(a_b_c.reverse()); }
Vec3 kuka_from_rotation(const Matrix3& rotation) { return yaskawa_from_rotation(rotation).reverse(); }

Matrix3 rotation_from_mitsubishi(const Vec3& a_b_c) { return rotation_from_yaskawa(a_b_c); }
Vec3 mitsubishi_from_rotation(const Matrix3& rotation) { return yaskawa_from_rotation(rotation); }

Matrix3 rotation_from_kawasaki(const Vec3& a) { return about_z(a.x()) * about_y(a.y()) * about_z(a.z()); }

Vec3 kawasaki_from_rotation(const Matrix3& r) {
  const double sine = std::hypot(r(0, 2), r(1, 2));
  const double middle = atan2_deg(sine, r(2, 2));
  if (sine < kLock) return {atan2_deg(-r(0, 1), r(1, 1)), middle, 0};
  const double c = r(0, 2) / sine, s = r(1, 2) / sine;
  return {atan2_deg(s, c), middle, atan2_deg(c * r(1, 0) - s * r(0, 0), c * r(1, 1) - s * r(0, 1))};
}

Matrix3 rotation_from_abb(const Vec4& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

Vec4 abb_from_rotation(const Matrix3& rotation) {
  const Eigen::Quaterniond q = quaternion_from_rotation(rotation);
  return {q.w(), q.x(), q.y(), q.z()};
}

Matrix3 rotation_from_ur(const Vec3& rotation_vector) { return rotation_from_vector(rotation_vector); }
Vec3 ur_from_rotation(const Matrix3& rotation) { return vector_from_rotation(rotation); }

Matrix3 rotation_from_ros(const Vec4& q) { return rotation_from_abb({q[3], q[0], q[1], q[2]}); }

Vec4 ros_from_rotation(const Matrix3& rotation) {
  const Vec4 q = abb_from_rotation(rotation);
  return {q[1], q[2], q[3], q[0]};
}

std::string_view name_of(Convention convention) {
  constexpr std::string_view kNames[] = {"yaskawa", "fanuc", "kuka", "mitsubishi", "kawasaki", "abb", "ur", "ros"};
  return kNames[static_cast<int>(convention)];
}

Convention convention_from_name(std::string_view name) {
  std::string known;
  for (Convention convention : kConventions) {
    if (name == name_of(convention)) return convention;
    known += (known.empty() ? "" : ", ") + std::string(name_of(convention));
  }
  throw Error(ErrorCode::bad_input, "saw the convention '" + std::string(name) + "', wanted one of " + known);
}

int rotation_numbers(Convention convention) {
  return convention == Convention::abb || convention == Convention::ros ? 4 : 3;
}

double position_unit_mm(Convention convention) { return convention == Convention::ros ? 1000 : 1; }

Pose pose_from_numbers(Convention convention, std::span<const double> numbers) {
  const int count = rotation_numbers(convention);
  TRIBIN_ASSERT(static_cast<int>(numbers.size()) == 3 + count);
  const Vec3 three(numbers[3], numbers[4], numbers[5]);
  const Vec4 four(numbers[3], numbers[4], numbers[5], count == 4 ? numbers[6] : 0.0);
  Matrix3 rotation = Matrix3::Identity();
  switch (convention) {
    case Convention::yaskawa:
      rotation = rotation_from_yaskawa(three);
      break;
    case Convention::fanuc:
      rotation = rotation_from_fanuc(three);
      break;
    case Convention::kuka:
      rotation = rotation_from_kuka(three);
      break;
    case Convention::mitsubishi:
      rotation = rotation_from_mitsubishi(three);
      break;
    case Convention::kawasaki:
      rotation = rotation_from_kawasaki(three);
      break;
    case Convention::abb:
      rotation = rotation_from_abb(four);
      break;
    case Convention::ur:
      rotation = rotation_from_ur(three);
      break;
    case Convention::ros:
      rotation = rotation_from_ros(four);
      break;
  }
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = Vec3(numbers[0], numbers[1], numbers[2]) * position_unit_mm(convention);
  return pose;
}

std::vector<double> numbers_from_pose(Convention convention, const Pose& pose) {
  const Matrix3 r = pose.linear();
  Vec4 numbers = Vec4::Zero();
  switch (convention) {
    case Convention::yaskawa:
      numbers.head<3>() = yaskawa_from_rotation(r);
      break;
    case Convention::fanuc:
      numbers.head<3>() = fanuc_from_rotation(r);
      break;
    case Convention::kuka:
      numbers.head<3>() = kuka_from_rotation(r);
      break;
    case Convention::mitsubishi:
      numbers.head<3>() = mitsubishi_from_rotation(r);
      break;
    case Convention::kawasaki:
      numbers.head<3>() = kawasaki_from_rotation(r);
      break;
    case Convention::abb:
      numbers = abb_from_rotation(r);
      break;
    case Convention::ur:
      numbers.head<3>() = ur_from_rotation(r);
      break;
    case Convention::ros:
      numbers = ros_from_rotation(r);
      break;
  }
  const Vec3 position = pose.translation() / position_unit_mm(convention);
  std::vector<double> out(position.begin(), position.end());
  out.insert(out.end(), numbers.begin(), numbers.begin() + rotation_numbers(convention));
  return out;
}

}  // namespace tribin::robot
