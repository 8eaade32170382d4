#include <algorithm>
#include <cmath>

#include "tribin/core/error.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin {
namespace {

// What counts as one motion when two descriptions of it are compared: what a user writes down with a few digits.
constexpr double kSameTurn = 1 * kDegree;
double same_mm(const Part& part) { return 0.01 * part.diameter_mm; }

bool one_axis(const Part& part, const ContinuousSymmetry& a, const ContinuousSymmetry& b) {
  const Eigen::Vector3d u = Eigen::Vector3d(a.axis).normalized(), v = Eigen::Vector3d(b.axis).normalized();
  const Eigen::Vector3d between = Eigen::Vector3d(b.point) - Eigen::Vector3d(a.point);
  return std::abs(u.dot(v)) > std::cos(kSameTurn) && between.cross(u).norm() < same_mm(part);
}

void add_axis(const Part& part, const ContinuousSymmetry& axis, SymmetryGroup& group) {
  if (std::none_of(group.continuous.begin(), group.continuous.end(),
                   [&](const ContinuousSymmetry& known) { return one_axis(part, known, axis); }))
    group.continuous.push_back(axis);
}

void add_motion(const Part& part, const Pose& motion, SymmetryGroup& group) {
  if (group.discrete.empty()) group.discrete.push_back(Pose::Identity());
  const SymmetryGroup turns = {{}, group.continuous};
  if (std::none_of(group.discrete.begin(), group.discrete.end(), [&](const Pose& known) {
        return same_placing(part, turns, known, motion, same_mm(part), kSameTurn);
      }))
    group.discrete.push_back(motion);
}

}  // namespace

bool same_placing(const Part& part, const SymmetryGroup& group, const Pose& a, const Pose& b, double distance_mm,
                  double angle) {
  const Eigen::Vector3d c = part.box_center();
  const auto near = [&](const Eigen::Vector3d& point, const Pose& other) {
    return (a * point - other * point).squaredNorm() < distance_mm * distance_mm;
  };
  const std::vector<ContinuousSymmetry>& round = group.continuous;
  const auto close = [&](const Pose& other) {
    if (round.empty()) return near(c, other) && rotation_angle(a.linear(), other.linear()) < angle;
    const Eigen::Vector3d axis = Eigen::Vector3d(round[0].axis).normalized(), point = round[0].point;
    if (round.size() > 1) return near(point, other);  // a ball
    const double cosine = (a.linear() * axis).dot(other.linear() * axis);
    return near(point + axis * axis.dot(c - point), other) && cosine > std::cos(angle);
  };
  if (close(b)) return true;
  for (std::size_t i = 1; i < group.discrete.size(); ++i)  // the identity comes first
    if (close(b * group.discrete[i])) return true;
  return false;
}

SymmetryGroup all_symmetries(const Part& part) {
  SymmetryGroup out = part.symmetry;
  for (const ContinuousSymmetry& axis : part.declared.continuous) add_axis(part, axis, out);
  if (part.declared.discrete.size() < 2) return out;
  std::vector<Pose> own = out.discrete;
  if (own.empty()) own.push_back(Pose::Identity());
  for (const Pose& declared : part.declared.discrete)
    for (const Pose& motion : own) add_motion(part, motion * declared, out);
  return out;
}

void declare_symmetry(Part& part, const SymmetryGroup& group) {
  const auto known = [&](const ContinuousSymmetry& axis) {
    return std::any_of(part.symmetry.continuous.begin(), part.symmetry.continuous.end(),
                       [&](const ContinuousSymmetry& own) { return one_axis(part, own, axis); });
  };
  for (const ContinuousSymmetry& axis : group.continuous)
    if (!known(axis)) add_axis(part, axis, part.declared);
  for (const Pose& motion : group.discrete)
    if (!same_placing(part, part.symmetry, Pose::Identity(), motion, same_mm(part), kSameTurn))
      add_motion(part, motion, part.declared);
}

void declare_free_spin(Part& part) {
  if (part.nearly_round.empty() && part.symmetry.continuous.empty())
    throw Error(ErrorCode::bad_option,
                part.name + ": no axis about which turns leave most of it in place, so that no spin can be free");
  declare_symmetry(part, {{}, part.nearly_round});
}

}  // namespace tribin
