#include "rim_place.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <vector>

namespace tribin {
namespace {

// Mixed pixels and the projector's shadow eat up to a pixel of one edge of a strip: half of that shifts its middle.
constexpr double kEdgeBiasPx = 0.5;

/// Points about as high as the rim and near it, bin frame.
std::vector<Vec2> points_of_rim(const BinShape& shape, const Scan& scan, const Pose& pose, double reach_mm,
                                int step_px) {
  const Pose bin_from_camera = pose.inverse();
  const double x = shape.inner_size_mm.x() / 2, y = shape.inner_size_mm.y() / 2, w = shape.wall_mm;
  std::vector<Vec2> out;
  const double margin = 2 * reach_mm + w;
  for (int v = step_px / 2; v < scan.height(); v += step_px)
    for (int u = step_px / 2; u < scan.width(); u += step_px) {
      if (!(scan.z_mm(u, v) > 0)) continue;
      const Eigen::Vector3d p = bin_from_camera * Eigen::Vector3d(scan.point(u, v));
      if (std::abs(p.z() - shape.inner_size_mm.z()) > 0.5 * w + reach_mm) continue;
      const double beyond = std::max(std::abs(p.x()) - x, std::abs(p.y()) - y);
      if (beyond > -margin && beyond < w + margin) out.emplace_back(p.x(), p.y());
    }
  return out;
}

struct Sums {
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};

/// Normal equations of (dx, dy, turn): each point's distance from its strip's middle line. Corners belong to no strip.
Sums strips_about(const BinShape& shape, const std::vector<Vec2>& points, const Eigen::Vector3d& place, double half) {
  const double length = shape.inner_size_mm.x(), width = shape.inner_size_mm.y(), w = shape.wall_mm;
  const double c = std::cos(place.z()), s = std::sin(place.z());
  Sums sums;
  const auto add = [&](const Eigen::Vector3d& row, double residual) {
    sums.h += row * row.transpose();
    sums.b += row * residual;
  };
  for (const Vec2& p : points) {
    const double dx = p.x() - place.x(), dy = p.y() - place.y();
    const double x = c * dx + s * dy, y = -s * dx + c * dy;
    const double off_x = std::abs(x) - (length + w) / 2, off_y = std::abs(y) - (width + w) / 2;
    if (std::abs(off_x) < half && off_y < -w - half)
      add({x > 0 ? 1.0 : -1.0, 0, (x > 0 ? -1 : 1) * y}, off_x);
    else if (std::abs(off_y) < half && off_x < -w - half)
      add({0, y > 0 ? 1.0 : -1.0, (y > 0 ? 1 : -1) * x}, off_y);
  }
  return sums;
}

}  // namespace

RimPlace place_on_rim(const BinShape& shape, const Scan& scan, const Pose& start, double reach_mm, int step_px) {
  RimPlace out;
  out.camera_from_bin = start;
  const std::vector<Vec2> points = points_of_rim(shape, scan, start, reach_mm, step_px);
  const double w = shape.wall_mm, pixel = (start * Vec3(0, 0, shape.inner_size_mm.z())).z() / scan.camera.fx;
  const double lever = std::hypot(shape.inner_size_mm.x(), shape.inner_size_mm.y()) / std::sqrt(12.0);
  const Eigen::Vector3d scale(1, 1, 1 / lever);
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  const double narrow = w / 2 + pixel;
  constexpr int kSteps = 12;
  for (int step = 0; step < kSteps; ++step) {
    const double half = narrow + reach_mm * std::pow(0.6, step);
    const Sums sums = strips_about(shape, points, place, half);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scale.asDiagonal() * sums.h * scale.asDiagonal());
    const Eigen::Vector3d b = scale.cwiseProduct(sums.b);
    Eigen::Vector3d move = Eigen::Vector3d::Zero();
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    constexpr double kFewest = 50;  // points that hold a direction: fewer may be a corner of anything
    const double bias = kEdgeBiasPx * pixel;
    for (int k = 0; k < 3; ++k) {
      const double count = eigen.eigenvalues()(k);
      if (count < kFewest) continue;
      const Eigen::Vector3d e = eigen.eigenvectors().col(k);
      move += e * (e.dot(b) / count);
      information += e * e.transpose() / (w * w / 12 / count + bias * bias);
    }
    place += scale.cwiseProduct(move);
    out.information = Matrix3(scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal());
  }
  Pose moved = Pose::Identity();
  moved.linear() = rotation_from_vector(Vec3(0, 0, place.z()));
  moved.translation() = Vec3(place.x(), place.y(), 0);
  out.camera_from_bin = start * moved;
  return out;
}

}  // namespace tribin
