#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "instance_report.hpp"

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
  for (const ContinuousSymmetry& s : part.symmetry.continuous) {
    const Eigen::Vector3d w = camera_from_part.linear() * Eigen::Vector3d(s.axis).normalized();
    const Eigen::Vector3d p = camera_from_part * Eigen::Vector3d(s.point);
    Vector6 d;
    d << w.cross(c - p), w;
    const double length = std::hypot(d.head<3>().norm(), d.tail<3>().norm() * part.gyration_mm);
    out.push_back(d / length);
  }
  return out;
}

void describe_uncertainty(const Part& part, const Matrix6& systematic_pull, const Matrix6& patch_pull,
                          const Refinement& refinement, Instance& instance) {
  const double lever = part.gyration_mm;
  const Vec6 scale = scale_of_motion(lever);
  // Fit residuals beyond the noise (a casting, an unknown systematic term) count as noise.
  const double inflation = std::max(1.0, refinement.rms_sigma * refinement.rms_sigma);
  Mat6 h = scale.asDiagonal() * Mat6(refinement.information) * scale.asDiagonal();
  const Mat6 keep = off_directions(free_directions_about_center(part, instance.camera_from_part), Vector6(scale));
  h = keep * h * keep;
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(h);
  const std::size_t free_count = part.symmetry.continuous.size();
  Mat6 held = Mat6::Zero();  // the inverse of the information, where there is any
  Mat6 root = Mat6::Zero();  // its square root: columns
  for (int k = static_cast<int>(free_count); k < 6; ++k) {
    const double information = std::max(eigen.eigenvalues()(k) / inflation, 1 / (part.diameter_mm * part.diameter_mm));
    const Vec6 e = eigen.eigenvectors().col(k);
    const double sigma = 1 / std::sqrt(information);
    held += e * e.transpose() * (sigma * sigma);
    root.col(k) = e * sigma;
    if (sigma > weak_limit_mm(part)) {
      WeakDirection weak;
      const Vec6 d = origin_from_center(part, instance.camera_from_part) * Vec6(scale.cwiseProduct(e));
      weak.direction = Vector6(d.normalized());
      weak.sigma_mm = sigma * e.head<3>().norm();
      weak.sigma = sigma * e.tail<3>().norm() / lever;
      weak.cure = e.head<3>().norm() > e.tail<3>().norm() ? "a view that shows a face across this direction"
                                                          : "a view that shows a feature off this axis";
      instance.weak_directions.push_back(weak);
    }
  }
  // Systematic: the pose follows the sensor's smooth errors as far as the pixels that hold it do.
  const Mat6 pull = Mat6(scale.asDiagonal()) * Mat6(systematic_pull) * Mat6(scale.asDiagonal());
  const Mat6 by_systematic = held * (keep * pull * keep) * held / (inflation * inflation);
  // What patches have in common: in the coordinates in which the noise's covariance is 1, no direction gets less.
  const Mat6 patches = Mat6(scale.asDiagonal()) * Mat6(patch_pull) * Mat6(scale.asDiagonal()) / (inflation * inflation);
  const Eigen::SelfAdjointEigenSolver<Mat6> common(Mat6(root.transpose() * patches * root));
  const Mat6 wide = root * common.eigenvectors() * common.eigenvalues().cwiseMax(1.0).asDiagonal() *
                    common.eigenvectors().transpose() * root.transpose();
  Mat6 covariance = Mat6(scale.asDiagonal()) * (wide + by_systematic) * Mat6(scale.asDiagonal());
  const Mat6 to_origin = origin_from_center(part, instance.camera_from_part);
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
