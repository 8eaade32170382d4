#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace tribin {

// Fixed-size types with DontAlign: the layout is the same whatever -m flags a client compiles with.
using Vec3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
using Vec3f = Eigen::Matrix<float, 3, 1, Eigen::DontAlign>;
using Vec2 = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::DontAlign>;
using Vector6 = Eigen::Matrix<double, 6, 1, Eigen::DontAlign>;
using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

/// A rigid motion. `b_from_a` maps points of frame a into frame b. Millimetres.
using Pose = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kDegree = kPi / 180.0;

/// Rotation by the vector w [rad]: Exp(w), by Rodrigues' formula.
Matrix3 rotation_from_vector(const Vec3& w);
/// The rotation vector of R, of length in [0, pi]: the inverse of rotation_from_vector.
Vec3 vector_from_rotation(const Matrix3& rotation);
/// The angle between two rotations [rad], in [0, pi].
double rotation_angle(const Matrix3& a, const Matrix3& b);
/// The pose moved by (dt in mm, w in rad), both in the target frame's axes: R' = Exp(w) R, t' = t + dt.
Pose moved(const Pose& pose, const Vector6& delta);
/// The same with the rotation about `center` (target frame), which moves by dt.
Pose moved_about(const Pose& pose, const Vec3& center, const Vector6& delta);
/// Two unit vectors u, v with (u, v, axis) right-handed and orthonormal; a fixed function of the axis.
void orthonormal_basis(const Vec3& axis, Vec3& u, Vec3& v);

}  // namespace tribin
