#include "surfel/point_quadric.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace tribin::surfel_detail {
namespace {

using Square = Eigen::Matrix<double, 6, 6>;
using Column = Eigen::Matrix<double, 6, 1>;

/// Fits the height field in the frame that `q` has: all six coefficients, or the first three. \return false where the
/// points do not hold it.
bool fit_in_frame(std::span<const Vec3f> points, std::span<const std::uint32_t> window, int used, PointQuadric& q) {
  Square h = Square::Zero();
  Column g = Column::Zero();
  double squares = 0;
  const double unit = 1.0 / q.reach_mm;  // coordinates in windows, for the condition of the normal equations
  for (std::uint32_t i : window) {
    const Vec3 d = points[i].cast<double>() - q.origin;
    const double x = d.dot(q.u) * unit, y = d.dot(q.v) * unit, z = d.dot(q.normal);
    const double row[6] = {1, x, y, x * x, x * y, y * y};
    for (int b = 0; b < 6; ++b) {
      for (int a = b; a < 6; ++a) h(a, b) += row[a] * row[b];
      g[b] += row[b] * z;
    }
    squares += z * z;
  }
  h = Square(h.selfadjointView<Eigen::Lower>());
  for (int k = used; k < 6; ++k) {
    h.row(k).setZero();
    h.col(k).setZero();
    h(k, k) = static_cast<double>(window.size());
    g[k] = 0;
  }
  const Eigen::LDLT<Square> solver(h);
  // A pivot of less than 1e-6 of the number of points: the points lie on a line or on two.
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() < 1e-6 * static_cast<double>(window.size()))
    return false;
  const Column c = solver.solve(g);
  const Square covariance = solver.solve(Square::Identity());
  const double freedom = static_cast<double>(window.size()) - used;
  q.residual_mm = std::sqrt(std::max(0.0, squares - c.dot(g)) / freedom);
  const double scale[6] = {1, unit, unit, unit * unit, unit * unit, unit * unit};
  for (int a = 0; a < 6; ++a) q.c[static_cast<std::size_t>(a)] = c[a] * scale[a];
  q.variance_slope = {covariance(1, 1) * unit * unit, covariance(1, 2) * unit * unit, covariance(2, 2) * unit * unit};
  q.variance_square = covariance.bottomRightCorner<3, 3>() * std::pow(unit, 4);
  return true;
}

}  // namespace

double PointQuadric::misfit(const Vec3& p) const {
  const Vec3 d = p - origin;
  const double x = d.dot(u), y = d.dot(v);
  const double slope_x = c[1] + 2 * c[3] * x + c[4] * y, slope_y = c[2] + c[4] * x + 2 * c[5] * y;
  const double height = d.dot(normal) - (c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y);
  return height / std::sqrt(1 + slope_x * slope_x + slope_y * slope_y);
}

Vec3 PointQuadric::normal_at(const Vec3& p) const {
  const Vec3 d = p - origin;
  const double x = d.dot(u), y = d.dot(v);
  return (normal - (c[1] + 2 * c[3] * x + c[4] * y) * u - (c[2] + c[4] * x + 2 * c[5] * y) * v).normalized();
}

PointCurvature curvature_of(const PointQuadric& q) {
  // After the second fit the slope at the origin is next to 0, so that the shape operator is the Hessian.
  const double xx = -2 * q.c[3], xy = -q.c[4], yy = -2 * q.c[5];
  const double middle = 0.5 * (xx + yy), skew = 0.5 * (xx - yy), half = std::sqrt(skew * skew + xy * xy);
  const double angle = 0.5 * std::atan2(xy, skew);  // of the algebraically larger one
  double a = std::cos(angle), b = std::sin(angle);
  PointCurvature k;
  k.k1 = middle + half;
  k.k2 = middle - half;
  if (std::abs(k.k2) > std::abs(k.k1)) {
    std::swap(k.k1, k.k2);
    std::swap(a, b);
    a = -a;
  }
  k.direction2 = (-b * q.u + a * q.v).normalized();
  const Vec3 row(2 * a * a, 2 * a * b, 2 * b * b);
  k.unit_sigma = std::sqrt(std::max(0.0, row.dot(q.variance_square * row)));
  return k;
}

namespace {

PointQuadric fit(std::span<const Vec3f> points, std::span<const std::uint32_t> window, int used) {
  PointQuadric q;
  if (static_cast<int>(window.size()) < used + 2) return q;
  q.origin = points[window[0]].cast<double>();
  Vec3 mean = Vec3::Zero();
  Matrix3 second = Matrix3::Zero();
  double reach2 = 0;
  for (std::uint32_t i : window) {
    const Vec3 d = points[i].cast<double>() - q.origin;
    mean += d;
    second += d * d.transpose();
    reach2 = std::max(reach2, d.squaredNorm());
  }
  if (!(reach2 > 0)) return q;
  q.reach_mm = std::sqrt(reach2);
  mean /= static_cast<double>(window.size());
  second = second / static_cast<double>(window.size()) - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(second)};
  q.normal = solver.eigenvectors().col(0);
  for (int round = 0; round < 2; ++round) {
    orthonormal_basis(q.normal, q.u, q.v);
    if (!fit_in_frame(points, window, used, q)) return q;
    if (round == 0) q.normal = q.normal_at(q.origin);
  }
  q.points = static_cast<int>(window.size());
  return q;
}

}  // namespace

PointQuadric fit_point_quadric(std::span<const Vec3f> points, std::span<const std::uint32_t> window) {
  return fit(points, window, 6);
}

PointQuadric fit_point_plane(std::span<const Vec3f> points, std::span<const std::uint32_t> window) {
  return fit(points, window, 3);
}

}  // namespace tribin::surfel_detail
