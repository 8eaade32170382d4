#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/core/geometry.hpp"

/// One rotation, in the numbers of each robot maker. Matrices are base_from_tool; angles in degrees, in (-180, 180].
///
/// Three-angle sets lock where their middle axis lines the outer two up: any split of the turn between them is the same
/// rotation. There the angle about the tool's own axis is 0: Rx (FANUC W, KUKA C, Mitsubishi A) or Kawasaki's T.
namespace tribin::robot {

using Vec4 = Eigen::Matrix<double, 4, 1, Eigen::DontAlign>;

/// Yaskawa (Rx, Ry, Rz) [deg]: R = Rz(Rz) Ry(Ry) Rx(Rx).
Matrix3 rotation_from_yaskawa(const Vec3& rx_ry_rz);
Vec3 yaskawa_from_rotation(const Matrix3& rotation);

/// FANUC (W, P, R) [deg]: Yaskawa's numbers.
Matrix3 rotation_from_fanuc(const Vec3& w_p_r);
Vec3 fanuc_from_rotation(const Matrix3& rotation);

/// KUKA (A, B, C) [deg]: R = Rz(A) Ry(B) Rx(C).
Matrix3 rotation_from_kuka(const Vec3& a_b_c);
Vec3 kuka_from_rotation(const Matrix3& rotation);

/// Mitsubishi (A, B, C) [deg]: R = Rz(C) Ry(B) Rx(A).
Matrix3 rotation_from_mitsubishi(const Vec3& a_b_c);
Vec3 mitsubishi_from_rotation(const Matrix3& rotation);

/// Kawasaki (O, A, T) [deg]: R = Rz(O) Ry(A) Rz(T), A in [0, 180].
Matrix3 rotation_from_kawasaki(const Vec3& o_a_t);
Vec3 kawasaki_from_rotation(const Matrix3& rotation);

/// ABB (q1, q2, q3, q4): a quaternion, q1 = w. Normalized on reading; w >= 0 on writing.
Matrix3 rotation_from_abb(const Vec4& q1_q2_q3_q4);
Vec4 abb_from_rotation(const Matrix3& rotation);

/// Universal Robots (rx, ry, rz): the rotation vector [rad], of length in [0, pi] on writing.
Matrix3 rotation_from_ur(const Vec3& rx_ry_rz);
Vec3 ur_from_rotation(const Matrix3& rotation);

/// ROS (x, y, z, w): a quaternion. Normalized on reading; w >= 0 on writing.
Matrix3 rotation_from_ros(const Vec4& x_y_z_w);
Vec4 ros_from_rotation(const Matrix3& rotation);

enum class Convention { yaskawa, fanuc, kuka, mitsubishi, kawasaki, abb, ur, ros };
inline constexpr Convention kConventions[] = {Convention::yaskawa,    Convention::fanuc,    Convention::kuka,
                                              Convention::mitsubishi, Convention::kawasaki, Convention::abb,
                                              Convention::ur,         Convention::ros};

/// "yaskawa", "fanuc", ...
std::string_view name_of(Convention convention);
/// \throws Error bad_input, naming the conventions that there are.
Convention convention_from_name(std::string_view name);
/// How many numbers its rotation takes: 3, or 4 for quaternions.
int rotation_numbers(Convention convention);
/// Millimetres in the unit of its positions: 1, or 1000 for ROS, which speaks in metres.
double position_unit_mm(Convention convention);

/// base_from_flange from the numbers as the controller shows them: x, y, z in its unit, then its rotation.
/// \param numbers  3 + rotation_numbers(convention), finite; a quaternion not 0.
Pose pose_from_numbers(Convention convention, std::span<const double> numbers);
std::vector<double> numbers_from_pose(Convention convention, const Pose& pose);

}  // namespace tribin::robot
