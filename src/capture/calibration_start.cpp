#include "capture/calibration_start.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace tribin::calibration_detail {
namespace {

/// Shift and scale that bring points to mean 0 and root mean square distance sqrt 2.
template <class Points>
Eigen::Matrix3d normaliser(const Points& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p.template head<2>();
  mean /= static_cast<double>(points.size());
  double square = 0;
  for (const auto& p : points) square += (p.template head<2>() - mean).squaredNorm();
  const double scale = std::sqrt(2.0 * static_cast<double>(points.size()) / std::max(square, 1e-300));
  Eigen::Matrix3d out;
  out << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return out;
}

}  // namespace

std::optional<Eigen::Matrix3d> homography_of(std::span<const Vec3> board, std::span<const Vec2> pixel,
                                             std::span<const double> weights) {
  if (board.size() < 4) return std::nullopt;
  const Eigen::Matrix3d from = normaliser(board), to = normaliser(pixel);
  Eigen::Matrix<double, 9, 9> square = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < board.size(); ++i) {
    const Eigen::Vector3d a = from * Eigen::Vector3d(board[i].x(), board[i].y(), 1);
    const Eigen::Vector3d b = to * Eigen::Vector3d(pixel[i].x(), pixel[i].y(), 1);
    Eigen::Matrix<double, 2, 9> rows = Eigen::Matrix<double, 2, 9>::Zero();
    rows.block<1, 3>(0, 0) = a.transpose();
    rows.block<1, 3>(0, 6) = -b.x() * a.transpose();
    rows.block<1, 3>(1, 3) = a.transpose();
    rows.block<1, 3>(1, 6) = -b.y() * a.transpose();
    square += (weights.empty() ? 1.0 : weights[i]) * rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(square);
  // Points on a line leave more than one solution.
  if (!(solver.eigenvalues()[1] > 1e-9 * solver.eigenvalues()[8])) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
  Eigen::Matrix3d out;
  out << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  out = to.inverse() * out * from;
  // The board is in front: the last row is positive on it.
  double side = 0;
  for (const Vec3& p : board) side += out.row(2).dot(Eigen::Vector3d(p.x(), p.y(), 1));
  return side < 0 ? Eigen::Matrix3d(-out) : out;
}

std::optional<double> focal_of(std::span<const Eigen::Matrix3d> homographies, const Vec2& principal) {
  double ab = 0, aa = 0, scale = 0;
  for (const Eigen::Matrix3d& h : homographies) {
    Eigen::Vector3d u = h.col(0), v = h.col(1);
    for (Eigen::Vector3d* c : {&u, &v}) *c -= (*c)[2] * Eigen::Vector3d(principal.x(), principal.y(), 0);
    const double size = 0.5 * (u.head<2>().squaredNorm() + v.head<2>().squaredNorm());
    // a s + b = 0 with s = 1 / f^2: the axes are orthogonal, and equally long.
    for (const auto& [a, b] :
         {std::pair{u.head<2>().dot(v.head<2>()), u[2] * v[2]},
          {0.5 * (u.head<2>().squaredNorm() - v.head<2>().squaredNorm()), 0.5 * (u[2] * u[2] - v[2] * v[2])}}) {
      ab += a / size * (b / size);
      aa += a / size * (a / size);
    }
    scale += 1;
  }
  // Tilts below some degrees change the axes' lengths by less than a thousandth: noise.
  if (!(aa > 1e-6 * scale) || !(ab < 0)) return std::nullopt;
  return std::sqrt(-aa / ab);
}

Pose pose_of_homography(const Eigen::Matrix3d& homography, double focal, const Vec2& principal) {
  Eigen::Matrix3d k_inverse;
  k_inverse << 1 / focal, 0, -principal.x() / focal, 0, 1 / focal, -principal.y() / focal, 0, 0, 1;
  Eigen::Matrix3d h = k_inverse * homography;
  h *= 2 / (h.col(0).norm() + h.col(1).norm());
  Eigen::Matrix3d axes;
  axes << h.col(0), h.col(1), h.col(0).cross(h.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (rotation.determinant() < 0)
    rotation = svd.matrixU() * Eigen::Vector3d(1, 1, -1).asDiagonal() * svd.matrixV().transpose();
  Pose out = Pose::Identity();
  out.linear() = rotation;
  out.translation() = h.col(2);
  return out;
}

}  // namespace tribin::calibration_detail
