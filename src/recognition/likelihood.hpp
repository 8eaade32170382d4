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
/// It ranks poses; how sure the first one is, `log_odds` tells.
std::vector<double> log_likelihoods(const SceneDepth& scene, Detail detail,
                                    std::span<const std::pair<const Part*, Pose>> poses, int step_px);

/// Log of the odds of each pose against the first, from the pixels that tell the two apart: those where they predict
/// places that differ by more than the noise and four times what errors common to whole faces amount to (estimated from
/// the first pose's residuals, patch by patch). A patch of the image says at most so much: one that is measured wrongly
/// must not outvote the others. Where no pixel tells, the odds are even: 0.
/// \param poses      refined; the first the likeliest.
/// \param elsewhere  cells that other parts explain: they tell nothing.
/// \return one for each pose; 0 for the first.
/// \source ours: "the discriminating patches" of the design notes, section 9. Residuals on all pixels let the pose win
///         that fits the sensor's smooth errors best: on simulated heaps a wrong pulley by 50 nats.
std::vector<double> log_odds(const SceneDepth& scene, Detail detail,
                             std::span<const std::pair<const Part*, Pose>> poses, int step_px,
                             const CellMask& elsewhere = {});

/// Poses by how likely they are, the likeliest first: the leader on all pixels, unless the pixels that tell prefer
/// another.
struct Ranking {
  std::vector<std::size_t> order;  ///< indices into the poses
  std::vector<double> log_odds;    ///< of order[i] against order[0], at most 0
};
Ranking rank_poses(const SceneDepth& scene, Detail detail, std::span<const std::pair<const Part*, Pose>> poses,
                   int step_px);

/// The same of poses that are ranked already: only the pixels that tell are asked again.
/// \param elsewhere  as for log_odds.
Ranking rank_again(const SceneDepth& scene, Detail detail, std::span<const std::pair<const Part*, Pose>> poses,
                   int step_px, const CellMask& elsewhere);

}  // namespace tribin
