#pragma once

#include <span>
#include <vector>

#include "solid.hpp"

// Parts cannot stand in each other: bodies whose surfaces do are moved apart along what their poses leave open.
namespace tribin {

struct Body {
  const Solid* solid = nullptr;
  std::vector<Vec3f> normals;  ///< of its points, unit, outward
  std::vector<Vec3f> points;   ///< of its surface, its frame
  Pose camera_from_body = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< as Instance::covariance
  bool fixed = false;                    ///< does not move; its covariance counts where limits are drawn
  double tolerance_mm = 0;               ///< how far it may be from its CAD
};

/// Two bodies that are in each other by more than their poses and the CAD's tolerance explain.
struct Overlap {
  std::size_t a = 0, b = 0;  ///< places in the list, a < b
  double depth_mm = 0;
  double limit_mm = 0;  ///< three sigma of the gap there, and both tolerances
};

/// \cost broad phase by boxes; some 2 us a point of one that lies in the box of the other.
std::vector<Overlap> overlaps(std::span<const Body> bodies);

/// Moves bodies that overlap to the poses that are likeliest together and not in each other: the least sum of squared
/// Mahalanobis distances from their own, under contacts that are linear for each of some steps. No pair gets
/// deeper than it was (2 um); what nothing pushes stays as it is, to the bit.
/// \param overlap  from `overlaps`.
/// \source ours; the dual by projected Gauss-Seidel, as for contacts in rigid body dynamics.
void separate(std::span<Body> bodies, std::span<const Overlap> overlap);

}  // namespace tribin
