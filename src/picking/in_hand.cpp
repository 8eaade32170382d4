#include "tribin/picking/in_hand.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace tribin::picking {
namespace {

using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

// The unknowns: how the part is held (dt, w about its middle, axes of the TCP), hand-eye (the same about the camera,
// axes of the base), the robot's shift at the looks.
constexpr int kHeld = 0, kEye = 6, kRobot = 12, kUnknowns = 15;
using System = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Rows = Eigen::Matrix<double, 6, kUnknowns>;
using State = Eigen::Matrix<double, kUnknowns, 1>;

// What no measurement is exact to: keeps a direction that is given without an error from being one.
constexpr double kLeast_mm = 1e-3, kLeast = 1e-5;
constexpr double kFree_mm = 1e3;  // sd of a direction that tells nothing

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// (dt, w) about one point -> about another.
Mat6 about(const Vec3& from, const Vec3& to) {
  Mat6 m = Mat6::Identity();
  m.topRightCorner<3, 3>() = -cross_matrix(to - from);
  return m;
}

/// The axes of the base -> those of a TCP.
Mat6 into(const Pose& base_from_tcp) {
  Mat6 m = Mat6::Zero();
  m.topLeftCorner<3, 3>() = m.bottomRightCorner<3, 3>() = base_from_tcp.linear().transpose();
  return m;
}

Mat6 even(double mm, double rad) {  // of 3-D norms
  Vec6 d;
  d << Vec6::Constant(1).head<3>() * (mm * mm / 3), Vec6::Constant(1).tail<3>() * (rad * rad / 3);
  return d.asDiagonal();
}

/// Equations `rows * unknowns = seen`, with the covariance of what they are off by.
struct Equations {
  Rows rows = Rows::Zero();
  Vec6 seen = Vec6::Zero();
  Mat6 noise = Mat6::Zero();
};

Equations of_grip(const Grip& grip, const Vec3& camera_at, const Vec3& middle, double robot_mm) {
  const Pose base_from_part = grip.base_from_tcp * grip.tcp_from_part;
  const Vec3 center = base_from_part * middle;
  const Mat6 turn = into(grip.base_from_tcp), to_center = about(base_from_part.translation(), center);
  Mat6 before = to_center * Mat6(grip.covariance) * to_center.transpose() + even(robot_mm, 0);
  before = turn * before * turn.transpose();
  Mat6 eye = turn * about(camera_at, center) * (grip.seen ? 1.0 : 0.0);
  const bool jaws = grip.gripper->kind != GripperKind::suction && grip.gripper->kind != GripperKind::magnet;
  const int centred = !jaws ? 0 : grip.gripper->kind == GripperKind::three_jaw ? 2 : 1;
  for (int k = 0; k < centred; ++k) before.row(k).setZero(), before.col(k).setZero(), eye.row(k).setZero();
  Equations out;
  out.rows.middleCols<6>(kHeld).setIdentity();
  out.rows.middleCols<6>(kEye) = eye;
  out.noise = before + even(grip.gripper->slip_mm, kSlipTurn);
  return out;
}

Equations of_look(const Grip& grip, const HandLook& look, const Vec3& camera_at, const Vec3& middle) {
  const Mat6 turn = into(look.base_from_tcp);
  const Vec3 center = look.base_from_part * middle;
  const Mat6 to_center = about(look.base_from_part.translation(), center);
  const Pose held = look.base_from_tcp.inverse() * look.base_from_part;
  Equations out;
  out.rows.middleCols<6>(kHeld).setIdentity();
  out.rows.middleCols<6>(kEye) = turn * about(camera_at, center);
  out.rows.middleCols<3>(kRobot) = turn.leftCols<3>();
  out.seen << held * middle - grip.tcp_from_part * middle,
      vector_from_rotation(held.linear() * grip.tcp_from_part.linear().transpose());
  out.noise = turn * to_center * Mat6(look.covariance) * to_center.transpose() * turn.transpose();
  for (const Vector6& direction : look.free_directions) {
    Vec6 free = turn * to_center * Vec6(direction);
    free /= free.norm();
    out.seen -= free * free.dot(out.seen);
    out.noise += kFree_mm * kFree_mm * free * free.transpose();
  }
  return out;
}

}  // namespace

double HeldPose::sigma_mm() const { return std::sqrt(covariance.topLeftCorner<3, 3>().trace()); }

Matrix6 covariance_of_standing(const WorkCell& cell) {
  const double robot = cell.robots.front().sigma_mm;
  double slip = 0;
  for (const Gripper& gripper : cell.grippers) slip = std::max(slip, gripper.slip_mm);
  Matrix6 covariance = Matrix6::Zero();
  covariance.diagonal() << Vec3::Constant(robot * robot + slip * slip), Vec3::Constant(kSlipTurn * kSlipTurn);
  return covariance;
}

HeldPose held_pose(const Grip& grip, std::span<const HandLook> looks, const CellHandEye& hand_eye,
                   const Vec3& camera_at, const Vec3& middle, double robot_mm, bool believe_grip) {
  std::vector<Equations> all;
  if (believe_grip || looks.empty()) all.push_back(of_grip(grip, camera_at, middle, robot_mm));
  for (const HandLook& look : looks) all.push_back(of_look(grip, look, camera_at, middle));
  const Mat6 least = even(kLeast_mm, kLeast);
  System information = System::Zero();
  information.block<6, 6>(kEye, kEye) = (even(hand_eye.sigma_mm, hand_eye.sigma_rad) + least).inverse();
  information.block<3, 3>(kRobot, kRobot) = (even(robot_mm, 0) + least).topLeftCorner<3, 3>().inverse();
  const System prior = information;
  State pull = State::Zero();
  for (const Equations& e : all) {
    const Mat6 weight = (e.noise + least).inverse();
    information += e.rows.transpose() * weight * e.rows;
    pull += e.rows.transpose() * weight * e.seen;
  }
  const System covariance = information.inverse();
  const State best = covariance * pull;
  HeldPose out;
  out.tcp_from_part = moved_about(grip.tcp_from_part, grip.tcp_from_part * middle, Vector6(best.head<6>()));
  out.covariance = covariance.topLeftCorner<6, 6>();
  out.chi2 = best.dot(prior * best);
  for (const Equations& e : all) {
    const Vec6 off = e.seen - e.rows * best;
    out.chi2 += off.dot((e.noise + least).inverse() * off);
  }
  return out;
}

}  // namespace tribin::picking
