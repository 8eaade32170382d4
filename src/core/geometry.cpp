#include "tribin/core/geometry.hpp"

#include <cmath>

namespace tribin {

Matrix3 rotation_from_vector(const Vec3& w) {
  const double angle = w.norm();
  if (angle < 1e-300) return Matrix3::Identity();
  return Eigen::AngleAxisd(angle, Eigen::Vector3d(w / angle)).toRotationMatrix();
}

Vec3 vector_from_rotation(const Matrix3& rotation) {
  const Eigen::AngleAxisd a{Eigen::Matrix3d(rotation)};
  return a.angle() <= kPi ? Vec3(a.axis() * a.angle()) : Vec3(a.axis() * (a.angle() - 2 * kPi));
}

double rotation_angle(const Matrix3& a, const Matrix3& b) {
  const Eigen::Matrix3d r = a.transpose() * b;
  const Vec3 s(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));  // 2 sin(angle) axis: exact for small angles
  return std::atan2(s.norm(), r.trace() - 1);
}

Pose moved(const Pose& pose, const Vector6& delta) {
  Pose result = pose;
  result.linear() = rotation_from_vector(delta.tail<3>()) * pose.linear();
  result.translation() += delta.head<3>();
  return result;
}

Pose moved_about(const Pose& pose, const Vec3& center, const Vector6& delta) {
  const Matrix3 turn = rotation_from_vector(delta.tail<3>());
  Pose result = pose;
  result.linear() = turn * pose.linear();
  result.translation() = turn * (pose.translation() - center) + center + delta.head<3>();
  return result;
}

void orthonormal_basis(const Vec3& axis, Vec3& u, Vec3& v) {
  // Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017: no branch on the largest component, no pole.
  const double sign = std::copysign(1.0, axis.z());
  const double a = -1.0 / (sign + axis.z());
  const double b = axis.x() * axis.y() * a;
  u = Vec3(1.0 + sign * axis.x() * axis.x() * a, sign * b, -sign * axis.x());
  v = Vec3(b, sign + axis.y() * axis.y() * a, -axis.y());
}

}  // namespace tribin
