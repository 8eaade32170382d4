#pragma once

#include <vector>

#include "tribin/recognition/bin.hpp"

namespace tribin {

/// A place where the scan has something like the bin's rim.
struct RimHypothesis {
  Pose camera_from_bin = Pose::Identity();
  double score = 0;  ///< share of the rim that stands out, seen from above: at most about 1
};

/// Seeks the rim: a rectangle of strips as wide as the walls, level, with nothing at their height on either side. For
/// each direction that planes of the scan call up, each height and each turn, the points are counted along the two
/// sides' directions, and the strips that stand out at the right distance vote for where the middle is.
/// \param near  only about as high, as tilted and as turned as this pose; none = everywhere.
/// \return best first, a few.
/// \source ours: the Hough transform of two parallel lines at a known distance, once for each pair of sides.
std::vector<RimHypothesis> seek_rim(const BinShape& shape, const Surfels& surfels, const PrimitiveModel& observation,
                                    const std::optional<Pose>& near);

}  // namespace tribin
