#pragma once

#include "tribin/recognition/bin.hpp"

namespace tribin {

/// A bin put right on its rim, in the rim's plane.
struct RimPlace {
  Pose camera_from_bin = Pose::Identity();
  /// Of (shift along x, along y [mm], turn about z [rad]) of the bin; 0 where the rim does not hold it.
  Matrix3 information = Matrix3::Zero();
};

/// Moves a bin in its rim's plane so that the points that lie on the rim lie about its strips' middle lines: walls are
/// seen too flat to hold these three directions, and what lies in the bin covers them.
/// \param reach_mm  how far off the rim may be.
/// \param step_px   every n-th pixel each way is looked at.
/// \source ours: mean shift over the strips with a window that shrinks to their width.
RimPlace place_on_rim(const BinShape& shape, const Scan& scan, const Pose& start, double reach_mm, int step_px);

}  // namespace tribin
