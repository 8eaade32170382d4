#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "capture/calibration_steps.hpp"

namespace tribin::calibration_detail {

BoardCoverage coverage_of(const Bundle& bundle, const BoardObserver& observer, int device) {
  BoardCoverage out;
  bool first = true;
  for (const Sight& s : bundle.sights) {
    if (s.device != device || !bundle.view_used[static_cast<std::size_t>(s.view)]) continue;
    Vec3 middle = Vec3::Zero();
    for (std::size_t i = 0; i < s.point.size(); ++i) {
      middle += s.point[i] / static_cast<double>(s.point.size());
      if (!s.used[i]) continue;
      const int column = std::clamp(static_cast<int>(3 * (s.pixel[i].x() + 0.5) / observer.width), 0, 2);
      const int row = std::clamp(static_cast<int>(3 * (s.pixel[i].y() + 0.5) / observer.height), 0, 2);
      ++out.points[static_cast<std::size_t>(3 * row + column)];
    }
    const Pose from_board = bundle.devices[static_cast<std::size_t>(device)].rig_from_device.inverse() *
                            bundle.rig_from_board[static_cast<std::size_t>(s.view)];
    // Against the line of sight to the board: that is the tilt which makes its far side look smaller.
    const Vec3 at = from_board * middle, normal = from_board.linear().col(2);
    const double sense = normal.dot(at) < 0 ? -1 : 1;
    const double about_y = std::atan2(sense * normal.x(), sense * normal.z()) - std::atan2(at.x(), at.z());
    const double about_x = std::atan2(sense * normal.y(), sense * normal.z()) - std::atan2(at.y(), at.z());
    const double distance = at.norm();
    const auto widen = [&](double value, double& least, double& most) {
      least = first ? value : std::min(least, value);
      most = first ? value : std::max(most, value);
    };
    widen(about_x, out.tilt_x_least, out.tilt_x_most);
    widen(about_y, out.tilt_y_least, out.tilt_y_most);
    widen(distance, out.nearest_mm, out.farthest_mm);
    first = false;
  }
  return out;
}

std::array<double, 9> ray_sd(const Intrinsics& p, const IntrinsicsCovariance& covariance, int width, int height,
                             const std::array<int, 9>& points) {
  // How pixels move with the intrinsics (numerically: nine rays, nine numbers) and with a rotation of the camera, which
  // its pose takes up: the part of the first that is not in the second.
  Eigen::Matrix<double, 18, 9> by_intrinsics;
  Eigen::Matrix<double, 18, 3> by_rotation;
  // The rotation is the one that fits best where the boards were; a little weight elsewhere holds it about one place.
  Eigen::Matrix<double, 18, 1> weight;
  int all = 0;
  for (int n : points) all += n;
  for (int k = 0; k < 9; ++k) {
    const double u = width * (2 * (k % 3) + 1) / 6.0 - 0.5, v = height * (2 * (k / 3) + 1) / 6.0 - 0.5;
    const Vec2 seen((u - p[2]) / p[0], (v - p[3]) / p[1]);
    const Vec2 ideal = undistorted({p[4], p[5], p[6], p[7], p[8]}, seen).value_or(seen);
    const Vec3 ray(ideal.x(), ideal.y(), 1);
    weight.segment<2>(2 * k).setConstant(points[static_cast<std::size_t>(k)] + 1e-3 * all);
    for (int i = 0; i < 9; ++i) {
      const double sd = std::sqrt(covariance(i, i)), step = sd > 0 ? sd : 1e-6;
      Intrinsics up = p, down = p;
      up[i] += step, down[i] -= step;
      by_intrinsics.block<2, 1>(2 * k, i) = (project(up, ray) - project(down, ray)) / (2 * step);
    }
    for (int i = 0; i < 3; ++i) {
      const Vec3 turn = 1e-5 * Vec3::Unit(i);
      by_rotation.block<2, 1>(2 * k, i) =
          (project(p, rotation_from_vector(turn) * ray) - project(p, rotation_from_vector(-turn) * ray)) / 2e-5;
    }
  }
  const Eigen::Matrix<double, 3, 18> weighed = by_rotation.transpose() * weight.asDiagonal();
  const Eigen::Matrix<double, 18, 18> left =
      Eigen::Matrix<double, 18, 18>::Identity() - by_rotation * (weighed * by_rotation).inverse() * weighed;
  const Eigen::Matrix<double, 18, 9> free = left * by_intrinsics;
  const Eigen::Matrix<double, 18, 18> spread = free * covariance * free.transpose();
  std::array<double, 9> out{};
  for (int k = 0; k < 9; ++k)
    out[static_cast<std::size_t>(k)] = std::sqrt(std::max(0.0, spread(2 * k, 2 * k) + spread(2 * k + 1, 2 * k + 1)));
  return out;
}

}  // namespace tribin::calibration_detail
