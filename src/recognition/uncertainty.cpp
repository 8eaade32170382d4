#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "instance_report.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin {
namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// (centre shift, w) -> (dt, w): the origin moves by dc + w x (t - c).
Mat6 origin_from_center(const Part& part, const Pose& pose) {
  const Eigen::Vector3d c = pose * Eigen::Vector3d(part.box_center());
  const Eigen::Vector3d t = pose.translation();
  Mat6 m = Mat6::Identity();
  m.topRightCorner<3, 3>() = -cross_matrix(t - c);
  return m;
}

}  // namespace

std::vector<Vector6> free_directions_about_center(const Part& part, const Pose& camera_from_part) {
  std::vector<Vector6> out;
  const Eigen::Vector3d c = camera_from_part * Eigen::Vector3d(part.box_center());
  for (const ContinuousSymmetry& s : all_symmetries(part).continuous) {
    const Eigen::Vector3d w = camera_from_part.linear() * Eigen::Vector3d(s.axis).normalized();
    const Eigen::Vector3d p = camera_from_part * Eigen::Vector3d(s.point);
    Vector6 d;
    d << w.cross(c - p), w;
    const double length = std::hypot(d.head<3>().norm(), d.tail<3>().norm() * part.gyration_mm);
    out.push_back(d / length);
  }
  return out;
}

namespace {

/// The information in coordinates in which radians count the lever, by its eigenvectors, the free directions first.
struct Held {
  Vec6 scale;
  Vec6 sigma;       ///< along each, by noise alone [mm]; of free ones 0
  Mat6 directions;  ///< columns
  int free = 0;
};

Held held_directions(const Part& part, const Refinement& refinement) {
  Held out;
  out.scale = scale_of_motion(part.gyration_mm);
  out.free = static_cast<int>(all_symmetries(part).continuous.size());
  const Mat6 keep = off_directions(free_directions_about_center(part, refinement.camera_from_part), Vector6(out.scale));
  // What nothing holds is known to a diameter; free directions alone have no information.
  const Mat6 h = out.scale.asDiagonal() * Mat6(refinement.information) * out.scale.asDiagonal();
  const Mat6 least = Mat6::Identity() / (part.diameter_mm * part.diameter_mm);
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(Mat6(keep * (h + least) * keep));
  out.directions = eigen.eigenvectors();
  out.sigma.setZero();
  // Sums of a million pixels leave what nothing holds a hair below zero.
  const double floor = least(0, 0);
  for (int k = out.free; k < 6; ++k) out.sigma[k] = 1 / std::sqrt(std::max(eigen.eigenvalues()(k), floor));
  return out;
}

}  // namespace

Matrix6 noise_covariance(const Part& part, const Refinement& refinement) {
  const Held held = held_directions(part, refinement);
  const Mat6 root = held.scale.asDiagonal() * held.directions * held.sigma.asDiagonal();
  return Matrix6(root * root.transpose());
}

void describe_uncertainty(const Part& part, const Matrix6& common_pull, const Refinement& refinement,
                          Instance& instance) {
  const double lever = part.gyration_mm;
  const Held held = held_directions(part, refinement);
  // Fit residuals beyond the noise (a casting, an unknown systematic term) count as noise.
  const double inflation = std::max(1.0, refinement.rms_sigma * refinement.rms_sigma);
  const Mat6 to_origin = origin_from_center(part, instance.camera_from_part);
  for (int k = held.free; k < 6; ++k) {
    const double sigma = held.sigma[k] * std::sqrt(inflation);
    if (sigma <= weak_limit_mm(part)) continue;
    const Vec6 e = held.directions.col(k);
    WeakDirection weak;
    weak.direction = Vector6((to_origin * Vec6(held.scale.cwiseProduct(e))).normalized());
    weak.sigma_mm = sigma * e.head<3>().norm();
    weak.sigma = sigma * e.tail<3>().norm() / lever;
    weak.cure = e.head<3>().norm() > e.tail<3>().norm() ? "a view that shows a face across this direction"
                                                        : "a view that shows a feature off this axis";
    instance.weak_directions.push_back(weak);
  }
  // The pose follows what errors have in common as far as the pixels that hold it do.
  const Mat6 noise = noise_covariance(part, refinement);
  Mat6 covariance = noise * inflation + noise * Mat6(common_pull) * noise;
  covariance = to_origin * covariance * to_origin.transpose();
  instance.free_directions.clear();
  for (const Vector6& f : free_directions_about_center(part, instance.camera_from_part)) {
    const Vec6 d = (to_origin * Vec6(f)).normalized();
    const Mat6 off = Mat6::Identity() - d * d.transpose();
    covariance = off * covariance * off;
    instance.free_directions.push_back(Vector6(d));
  }
  instance.covariance = 0.5 * (covariance + covariance.transpose());
}

double motion_variance(const Instance& instance, const Vec3& at) {
  // A point moves by dt + w x (point - origin).
  const Eigen::Vector3d arm = at - Vec3(instance.camera_from_part.translation());
  Eigen::Matrix<double, 3, 6> j;
  j << 1, 0, 0, 0, arm.z(), -arm.y(),  //
      0, 1, 0, -arm.z(), 0, arm.x(),   //
      0, 0, 1, arm.y(), -arm.x(), 0;
  return (j * Eigen::Matrix<double, 6, 6>(instance.covariance) * j.transpose()).trace();
}

}  // namespace tribin
