#pragma once

#include <optional>

#include "tribin/part/part.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin {

/// What a scan says of a part whose pose is nearly known.
struct KnownPose {
  /// The pose that explains the scan, where it keeps the limits of every answer. It may be a self-similar one of the
  /// pose that was known; a score below 2/3 says that the scan does not tell them apart, or does not hold the pose.
  std::optional<Instance> instance;
  std::vector<Reason> rejected;  ///< why there is none
  double measured = 0;           ///< share of the silhouette at the known pose that is measured and not hidden
  double seen_through = 0;       ///< share of that where the scan lies far behind: the part is not there
};

/// Measures a part that stands nearly where it is said to, as one in a gripper or a fixture does: refined, its
/// self-similar poses tried, verified and described as an answer of recognize() is, without a search.
/// \param surfels           of a scan whose pixels hold no measurement where something else is known to be (a gripper)
/// \param camera_from_part  right within a hundredth of the part's diameter
/// \cost 0.1 to 0.3 s, most of it for self-similar poses
KnownPose measure_known(const Surfels& surfels, const Part& part, const Pose& camera_from_part);

}  // namespace tribin
