#pragma once

#include <span>
#include <vector>

#include "detail.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// Log-likelihoods of the scan at many poses of one part, up to a constant that they share: half the squared residuals
/// in local sigma of the pixels that a pose covers, bounded at 4 sigma, against leaving them unexplained. Each pose is
/// rendered and forgotten, by itself: no common window is looked at.
std::vector<double> render_scores(const SceneDepth& scene, const Part& part, Detail detail, std::span<const Pose> poses,
                                  int step_px);

/// What of the scan contradicts each pose, in the same nats: where it is looked through, or not at its surface but near
/// it (3 % of the diameter). What hides the part counts nothing, and neither does what it explains or leaves over.
std::vector<double> contradictions(const SceneDepth& scene, const Part& part, Detail detail,
                                   std::span<const Pose> poses, int step_px);

}  // namespace tribin
