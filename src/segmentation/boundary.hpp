#pragma once

#include "tribin/segmentation/primitives.hpp"

namespace tribin::segmentation_detail {

/// Outer rims and holes of a plane's support, traced on the raw pixels: those within 4 local sigma of the plane beside
/// its surfels. Invalid lines up to 4 px wide inside the plane (seams of decoders) are bridged. \return loops of >= 40
/// px; points lie on the plane, in order, averaged over 5 pixel edges: about 0.15 px.
std::vector<BoundaryLoop> plane_boundaries(const Primitive& plane, const Surfels& surfels);

/// Holes whose rim runs over several planes that nearly continue each other: the halves of a split housing, a face cut
/// by a groove. Circular ones are given to the largest of the planes.
void add_common_holes(std::vector<Primitive>& primitives, const Surfels& surfels);

/// The circle through most of the points of a planar loop: robust, geometric distances.
/// \return none where less than half of the points, or less than 90 deg, lie on one circle within 4 `pitch_mm`.
std::optional<BoundaryCircle> fit_boundary_circle(const std::vector<Vec3f>& points, const Vec3& normal,
                                                  double pitch_mm);

}  // namespace tribin::segmentation_detail
