#pragma once

#include <span>
#include <vector>

#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// What the depth image says about points of a part at a pose. The three states of a point, and no data.
struct LookUp {
  int supported = 0;   ///< the scan is where the point is, and its normal agrees
  int unsure = 0;      ///< the scan is where the point is, but has no normal there: an edge or a hole nearby
  int background = 0;  ///< the scan is where the point is, but belongs to the background: neither for nor against
  int violated = 0;    ///< the scan lies behind: the camera sees through the part
  int occluded = 0;    ///< the scan lies in front: nothing is known
  int no_data = 0;     ///< no measurement there, or outside of the image
  int total = 0;

  /// In (-inf, 1]: 1 when all is supported. A see-through point costs three supported ones; an occluded or unmeasured
  /// one little, since nothing speaks against it. \source ours; weights as the log-odds of algorithm notes section 8,
  /// rounded.
  double score() const {
    return total == 0 ? -1.0 : (supported + 0.5 * unsure - 3.0 * violated - 0.1 * occluded - 0.05 * no_data) / total;
  }
};

/// A look-up is given up after so many points when their score is below this.
struct GiveUp {
  std::size_t after = 0;
  double below = 0;
};

/// Looks the first `count` points up in the depth image.
/// \param points, normals  part frame, visible from the camera at this pose (a PartView).
/// \param tolerance_mm     distance along the normal up to which a point is supported.
/// \param give_up          in the order of `after`.
/// \cost                   about 10 ns a point.
LookUp look_up(const SceneDepth& scene, const Pose& camera_from_part, std::span<const Vec3f> points,
               std::span<const Vec3f> normals, std::size_t count, double tolerance_mm,
               std::span<const GiveUp> give_up = {});

struct PointRefineOptions {
  int iterations = 8;
  double start_tolerance_mm = 4;  ///< points farther off than this do not pull, at the start
  double end_tolerance_mm = 1;    ///< and at the end
  Vec3 center = Vec3::Zero();     ///< part frame
  double lever_mm = 1;
};

/// Point-to-plane ICP of a view's points on the depth image, projective association: coarse poses to fine ones.
/// \cost about 15 ns a point and iteration.
Pose refine_points(const SceneDepth& scene, const Pose& start, std::span<const Vec3f> points,
                   std::span<const Vec3f> normals, std::size_t count, const PointRefineOptions& options);

}  // namespace tribin
