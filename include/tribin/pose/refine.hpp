#pragma once

#include <span>
#include <vector>

#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

struct RefineOptions {
  int iterations = 8;           ///< 0..50; 0 leaves the pose and tells its information
  int step_px = 1;              ///< every n-th pixel each way
  double start_scale_mm = 2.0;  ///< residual at which a pixel counts half, at the start; ends at 3 local sigma
  std::vector<Vector6> frozen;  ///< directions (mm, rad about `center`) that must not move: free by symmetry
  double weak_mm = 0;           ///< directions that the data holds to less than this sd are not moved; 0 = all are
  Vec3 center = Vec3::Zero();   ///< part frame; rotations turn about it (the box centre)
  double lever_mm = 1;          ///< length that turns radians into mm when directions are compared (radius of gyration)
  double kernel_sigmas = 3;     ///< the kernel ends at so many local sigma; > 0
  bool by_patches = false;      ///< pixels count only where half of the patch around them fits: few fit by chance
  bool outlines = false;        ///< the part's outline pulls towards depth edges, in true units
  double cad_sigma_mm = 0;      ///< how far the part may be from its CAD (chord error, casting)
};

struct Refinement {
  Pose camera_from_part = Pose::Identity();
  /// Of (dt in mm, w in rad about the centre), camera axes: pixels (noise correlation and step counted) and outlines.
  Matrix6 information = Matrix6::Zero();
  int pixels = 0;        ///< that hold the pose
  double rms_mm = 0;     ///< of their residuals along the surface normal
  double rms_sigma = 0;  ///< the same in units of the local sigma
};

/// (mm, rad) = scale * coordinates in which radians count `lever_mm`.
Vector6 scale_of_motion(double lever_mm);

/// The projection off directions (mm, rad) that are free or frozen, in the coordinates of scale_of_motion.
Matrix6 off_directions(std::span<const Vector6> directions, const Vector6& scale);

/// Moves a pose so that the CAD surface meets the scan: projective association by an index render, point-to-plane
/// residuals against the facet that each pixel sees, Geman-McClure weights with a falling scale.
/// \cost one render and about 15 ns a pixel per iteration.
/// \source ours; robust graduated kernel after Zhou, Park, Koltun, "Fast Global Registration", 2016.
Refinement refine_pose(const RenderMesh& mesh, const SceneDepth& scene, const Pose& start,
                       const RefineOptions& options);

}  // namespace tribin
