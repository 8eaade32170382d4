#include "part/symmetry_group.hpp"

#include <algorithm>
#include <cmath>

namespace tribin {
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

int index_of(std::span<const Matrix3> members, const Matrix3& rotation, double tolerance) {
  const double limit = 2 * tolerance * tolerance;  // |A - B|^2 = 4 (1 - cos angle)
  for (std::size_t i = 0; i < members.size(); ++i)
    if ((members[i] - rotation).squaredNorm() < limit) return static_cast<int>(i);
  return -1;
}

std::vector<Matrix3> close_group(std::span<const Matrix3> given, double tolerance, std::size_t most) {
  std::vector<Matrix3> members = {Matrix3::Identity()};
  for (const Matrix3& m : given)
    if (index_of(members, m, tolerance) < 0) members.push_back(m);
  // Products with the given ones reach all: every member of a finite group is a chain of them.
  const std::size_t generators = members.size();
  for (std::size_t i = 0; i < members.size(); ++i)
    for (std::size_t j = 1; j < generators; ++j) {
      const Matrix3 product = members[i] * members[j];
      if (index_of(members, product, tolerance) >= 0) continue;
      members.push_back(product);
      if (members.size() > most) return {};
    }
  return members;
}

std::vector<Matrix3> sharpen_group(std::span<const Matrix3> given, double tolerance) {
  std::vector<Matrix3> members(given.begin(), given.end());
  std::vector<double> angles(members.size(), 0);
  std::vector<Vec3> axes(members.size(), Vec3::Zero());
  for (std::size_t i = 1; i < members.size(); ++i) {
    const Vec3 w = vector_from_rotation(members[i]);
    axes[i] = w.normalized();
    int order = 1;  // the first power that is the identity; it divides the order of the group
    for (Matrix3 power = members[i]; rotation_angle(power, Matrix3::Identity()) > tolerance; power *= members[i]) {
      if (++order > static_cast<int>(members.size())) return members;
      // Errors grow with the power: put each on the member that it is.
      if (const int k = index_of(members, power, tolerance); k >= 0) power = members[k];
    }
    angles[i] = 2 * kPi / order * std::round(w.norm() * order / (2 * kPi));
  }
  for (int round = 0; round < 3; ++round) {
    std::vector<Vec3> sums(members.size(), Vec3::Zero());
    for (const Matrix3& h : members)
      for (std::size_t i = 1; i < members.size(); ++i) {
        const int k = index_of(members, h * members[i] * h.transpose(), tolerance);
        if (k <= 0) continue;
        const Vec3 axis = h * axes[i];
        sums[k] += axis.dot(axes[k]) < 0 ? Vec3(-axis) : axis;  // of half turns either end of the axis will do
      }
    for (std::size_t i = 1; i < members.size(); ++i) {
      axes[i] = sums[i].normalized();
      members[i] = rotation_from_vector(axes[i] * angles[i]);
    }
  }
  std::stable_sort(members.begin() + 1, members.end(), [](const Matrix3& a, const Matrix3& b) {
    return std::lround(rotation_angle(a, Matrix3::Identity()) * 1e4) <
           std::lround(rotation_angle(b, Matrix3::Identity()) * 1e4);
  });
  return members;
}

}  // namespace tribin
