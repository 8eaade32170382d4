#pragma once

#include <span>
#include <vector>

#include "tribin/part/part.hpp"

namespace tribin {

/// Root mean square distance between the places to which two motions take a body with this covariance and middle.
double rms_between(const Pose& a, const Pose& b, const Vec3& middle, const Matrix3& covariance);

/// The same, smallest over b g for all g of the group: 0 if they show the same picture of the part.
double rms_modulo(const Pose& a, const Pose& b, const SymmetryGroup& group, const Vec3& middle,
                  const Matrix3& covariance);

/// Makes a finite group of rotations about `middle` from members that are known up to `tolerance` (rad): adds products
/// until it is closed and averages each member over the pairs that give it. Identity first, then by angle and axis.
/// Returns an empty list where more than `most` members come out: they were no group.
std::vector<Matrix3> close_group(std::span<const Matrix3> members, double tolerance, std::size_t most);

}  // namespace tribin
