#include "part/symmetry_group.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace tribin {
namespace {

int index_of(std::span<const Matrix3> members, const Matrix3& rotation, double tolerance) {
  for (std::size_t i = 0; i < members.size(); ++i)
    if (rotation_angle(members[i], rotation) < tolerance) return static_cast<int>(i);
  return -1;
}

Matrix3 nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

double rms_between(const Pose& a, const Pose& b, const Vec3& middle, const Matrix3& covariance) {
  const Matrix3 d = a.linear() - b.linear();
  return std::sqrt((a * middle - b * middle).squaredNorm() + std::max(0.0, (d * covariance * d.transpose()).trace()));
}

double rms_modulo(const Pose& a, const Pose& b, const SymmetryGroup& group, const Vec3& middle,
                  const Matrix3& covariance) {
  double least = -1;
  for (const Pose& g : group.discrete) {
    Pose moved = b * g;
    for (const ContinuousSymmetry& c : group.continuous) {
      // The turn about the axis that brings b g nearest to a: the twist of their difference (swing-twist split).
      const Eigen::Quaterniond q{Eigen::Matrix3d(moved.linear().transpose() * a.linear())};
      const double angle = 2 * std::atan2(c.axis.dot(Vec3(q.vec())), q.w());
      Pose spin = Pose::Identity();
      spin.linear() = rotation_from_vector(c.axis * angle);
      spin.translation() = c.point - spin.linear() * c.point;
      moved = moved * spin;
    }
    const double rms = rms_between(a, moved, middle, covariance);
    if (least < 0 || rms < least) least = rms;
  }
  return least;
}

std::vector<Matrix3> close_group(std::span<const Matrix3> given, double tolerance, std::size_t most) {
  std::vector<Matrix3> members = {Matrix3::Identity()};
  for (const Matrix3& m : given)
    if (index_of(members, m, tolerance) < 0) members.push_back(m);
  for (std::size_t i = 0; i < members.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j)
      for (const Matrix3& product : {Matrix3(members[i] * members[j]), Matrix3(members[j] * members[i])}) {
        if (index_of(members, product, tolerance) >= 0) continue;
        members.push_back(product);
        if (members.size() > most) return {};
      }
  // Each member is the mean of all products of two members that give it: errors of the members average out.
  for (int round = 0; round < 3; ++round) {
    std::vector<Eigen::Matrix3d> sums(members.size(), Eigen::Matrix3d::Zero());
    for (const Matrix3& a : members)
      for (const Matrix3& b : members) {
        const int k = index_of(members, a * b, tolerance);
        if (k >= 0) sums[k] += a * b;
      }
    for (std::size_t k = 1; k < members.size(); ++k) members[k] = nearest_rotation(sums[k]);
  }
  std::stable_sort(members.begin() + 1, members.end(), [](const Matrix3& a, const Matrix3& b) {
    const long angle_a = std::lround(rotation_angle(a, Matrix3::Identity()) * 1e4);
    const long angle_b = std::lround(rotation_angle(b, Matrix3::Identity()) * 1e4);
    return angle_a < angle_b;
  });
  return members;
}

}  // namespace tribin
