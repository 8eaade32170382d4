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

/// The place of a rotation in the list, up to `tolerance` [rad]; -1 = it is not in it.
int index_of(std::span<const Matrix3> members, const Matrix3& rotation, double tolerance);

/// Adds products of the members, which are known up to `tolerance` [rad], until none is new. Identity first.
/// Returns an empty list where more than `most` members come out: they were no group.
std::vector<Matrix3> close_group(std::span<const Matrix3> members, double tolerance, std::size_t most);

/// Makes the members of a closed group exact: angles become the fractions of a turn that their orders ask for, axes the
/// mean of all axes that other members turn into them. Identity first, then by angle.
std::vector<Matrix3> sharpen_group(std::span<const Matrix3> members, double tolerance);

}  // namespace tribin
