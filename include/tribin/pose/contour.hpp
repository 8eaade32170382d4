#pragma once

#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// Normal equations of the outline: how far the scan's depth edges lie from the part's occluding edges, in true units
/// (pixels of the image against the sd of an edge).
struct ContourSums {
  Matrix6 information = Matrix6::Zero();  ///< of (dt in mm, w in rad about the centre), camera axes
  Vector6 pull = Vector6::Zero();         ///< right-hand side: information * step = pull
  int samples = 0;                        ///< places on the outline where an edge was found
  double rms_px = 0;                      ///< of the edge distances

  // A sensor that draws steps out leaves each edge less sure, and all of them drawn outwards, or inwards, together.
  double held = 1;                    ///< share of the information that the edges hold in the end
  double common_px = 0;               ///< sd of what all of them are off by
  Vector6 outward = Vector6::Zero();  ///< the right-hand side of edges that are all 1 px further out
  double outward_weight = 0;          ///< sum of the samples' weights [1/px^2]
  double outward_pull = 0;            ///< sum of their weighted distances [1/px]

  /// The equations with a share of their weight, without what the edges have in common.
  ContourSums without_common(double share) const;
  /// Follows the pose by a step (dt in mm, w in rad about the centre).
  void move(const Vector6& step);
};

/// \param render     of the part at this pose; its step sets the spacing of the samples.
/// \param center     in the camera frame; rotations turn about it.
/// \param reach_px   how far from the outline an edge is looked for.
/// \source ours. Edges of the mesh between a facet that looks at the camera and one that does not, where nothing of the
/// part lies
///         beyond; facets seen at more than 65 deg are left out, because grazing drop-out eats their rim. Where the
///         sensor draws steps out, an edge is where the depth has gone half of the way.
ContourSums contour_sums(const RenderMesh& mesh, const SceneDepth& scene, const Pose& camera_from_part,
                         const IndexRender& render, const Vec3& center, double reach_px);

}  // namespace tribin
