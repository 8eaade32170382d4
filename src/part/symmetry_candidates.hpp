#pragma once

#include <span>
#include <vector>

#include "part/surface_index.hpp"

namespace tribin {

/// How near is near: what a motion is scored with.
struct Nearness {
  double radius_mm = 0;  ///< widened by the sample's own slack
  double angle = 0;      ///< [rad] of the normals, widened by the sample's bend
};

/// The share of the samples that the motion takes to within reach of the surface. Stops early, with a lower share than
/// `floor`, once `floor` cannot be reached.
double overlap_of(const SurfaceIndex& surface, std::span<const SurfaceSample> samples, const Pose& motion,
                  const Nearness& nearness, double floor = 0);

/// Fits the motion to the surface by point-to-plane ICP whose reach shrinks from `from_mm` to `to_mm`. Directions that
/// the surface does not hold stay where they were.
Pose polish(const SurfaceIndex& surface, std::span<const SurfaceSample> samples, Pose motion, double from_mm,
            double to_mm, int iterations);

struct Axis {
  Vec3 direction = Vec3::UnitZ();
  Vec3 point = Vec3::Zero();
};

/// The rotation by `angle` about the axis.
Pose turn(const Axis& axis, double angle);
/// The fixed axis of a motion (its screw axis); undefined for motions that turn less than a degree.
Axis axis_of(const Pose& motion);

/// Axes about which the part may have symmetries, most promising first: principal axes, peaks of the face normals and
/// the sums of pairs of them, axes that many normals are perpendicular to; through the centroid, and through the place
/// that the normals beside the axis point to where that is another one.
std::vector<Axis> candidate_axes(const SurfaceIndex& surface, std::span<const SurfaceSample> samples);

struct Candidate {
  Pose motion = Pose::Identity();
  double overlap = 0;  ///< coarse
};

/// Tries all turns about the axis, and all of them after half a turn across it; returns the local maxima of the
/// overlap.
std::vector<Candidate> scan_turns(const SurfaceIndex& surface, std::span<const SurfaceSample> samples, const Axis& axis,
                                  const Nearness& nearness, double min_overlap);

}  // namespace tribin
