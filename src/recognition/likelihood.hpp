#pragma once

#include <span>
#include <utility>
#include <vector>

#include "cell_mask.hpp"
#include "detail.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// Log-likelihood of the scan where any of the poses predicts something: each pixel's residual in its local sigma,
/// bounded at 4 sigma, over the equivalent number of independent pixels. Only differences between poses mean something.
/// It ranks poses; how sure the first one is, the odds of `rank_poses` tell.
std::vector<double> log_likelihoods(const SceneDepth& scene, Detail detail,
                                    std::span<const std::pair<const Part*, Pose>> poses, int step_px);

/// Poses by how likely they are, the likeliest first: the leader on all pixels, unless the pixels that tell it from
/// another prefer that one.
struct Ranking {
  std::vector<std::size_t> order;  ///< indices into the poses
  std::vector<double> log_odds;    ///< of order[i] against order[0], at most 0
};
Ranking rank_poses(const SceneDepth& scene, Detail detail, std::span<const std::pair<const Part*, Pose>> poses,
                   int step_px);

/// The same of poses that are ranked already: only the pixels that tell are asked again.
/// \param elsewhere  cells that other parts explain: they tell nothing.
Ranking rank_again(const SceneDepth& scene, Detail detail, std::span<const std::pair<const Part*, Pose>> poses,
                   int step_px, const CellMask& elsewhere);

}  // namespace tribin
