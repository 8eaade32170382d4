#pragma once

#include <vector>

#include "tribin/grasp/grasp.hpp"

// The bin as bodies, and the way in and out over its rim.
namespace tribin::grasp {

/// Floor and four walls, base's frame. Corners belong to the walls along x.
std::vector<Convex> bin_bodies(const CellBin& bin);

/// How far up (base's z) bodies must go until they are `clearance` above the rim [mm]; 0 where they are.
double way_over_rim(const CellBin& bin, const std::vector<Convex>& bodies, double clearance);

/// The lowest of the bodies' points along a unit direction `up` [mm].
double lowest_along(const std::vector<Convex>& bodies, const Vec3& up);

/// The least gap between two sets of bodies, as far as `enough` [mm].
double least_gap(const std::vector<Convex>& a, const std::vector<Convex>& b, double enough);

/// The bodies at a pose, swept along a straight move of that frame.
std::vector<Convex> swept(const std::vector<Convex>& bodies, const Pose& base_from_frame, const Vec3& move);

}  // namespace tribin::grasp
