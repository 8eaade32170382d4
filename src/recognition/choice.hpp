#pragma once

#include <span>

#include "candidates.hpp"
#include "cell_mask.hpp"
#include "tribin/recognition/instance.hpp"

namespace tribin {

/// A candidate brought to its best: its self-similar poses and spins tried, refined on more pixels.
struct Polished {
  PoseCandidate candidate;
  CellMask mask;
  std::vector<std::pair<Pose, double>> others;  ///< self-similar poses and the log of their odds against it, best first
  double class_odds = 0;                        ///< summed odds of other parts in its place against it
};

/// The cells whose pixels a rendered pose supports.
CellMask mask_of(const Part& part, const SceneDepth& scene, const PoseCandidate& candidate);

/// Worth a fit on more pixels? By its verification on few of them: twice what `plausible` leaves open.
bool hopeful(const Part& part, const PoseCandidate& candidate, std::vector<Reason>& rejected);

/// A candidate as it stands, verified on some thousand pixels: an outline has few samples on a thousand.
PoseCandidate looked_at_closely(const SceneDepth& scene, const Part& part, const PoseCandidate& candidate);

/// A candidate refined and verified on some thousand pixels, as it stands: no other pose is tried.
PoseCandidate settled_on_scan(const SceneDepth& scene, const Part& part, const PoseCandidate& candidate);

/// Worth a polish? The limits of `acceptable`, as far as a pose that a self-similar one outdoes may miss them.
bool plausible(const Part& part, const PoseCandidate& settled, std::vector<Reason>& rejected);

/// \param settled  from settled_on_scan.
/// \param also     poses that the search found in the same place: where little of a part is seen, they may explain it
///                 as well.
Polished polish(const SceneDepth& scene, std::span<const Part> parts, const PoseCandidate& settled,
                std::span<const Pose> also);

/// A polished pose against its self-similar ones once more, when it is known what other parts explain: what one of them
/// hides or shows tells nothing. The first pose may change.
/// \param elsewhere  cells that the others explain.
void decide_again(const SceneDepth& scene, std::span<const Part> parts, const CellMask& elsewhere, Polished& polished);

/// Share of the silhouette that must be measured, on surfaces that are not too large for the part: less than a fifth is
/// not a look at it, any face of its size would do.
inline constexpr double kLeastMeasured = 0.2;

/// Limits that an answer must keep. Value and limit go into `rejected` when one fails.
bool acceptable(const Part& part, const PoseCandidate& candidate, std::vector<Reason>& rejected);

/// Is nothing against it but that little of it is seen?
bool shows_too_little(const Part& part, const PoseCandidate& candidate);

}  // namespace tribin
