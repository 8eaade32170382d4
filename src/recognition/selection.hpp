#pragma once

#include <span>
#include <vector>

#include "budget.hpp"
#include "choice.hpp"

namespace tribin {

/// Poses that were looked at closely and refused: later rounds need not look again, since what is refused by its own
/// surface and outline is so whatever else the scan holds.
struct Refused {
  std::vector<PoseCandidate> candidates;
  /// The likeliest at their places, that show too little: what is less likely there is not right for showing more.
  std::vector<Polished> hidden;

  bool holds(std::span<const Part> parts, const PoseCandidate& c) const;
};

/// What stands already. Two of a part cannot stand in one place, in whatever turn: not nearer than the thinnest sheets
/// nest, a fiftieth of their diameter.
struct Standing {
  std::vector<PoseCandidate> candidates;

  bool in_place_of(std::span<const Part> parts, const PoseCandidate& c) const;
};

/// Each place of the scan goes to the pose, of any part, that explains it best. Several places that share nothing are
/// settled at a time.
/// \param stands   what earlier rounds found; grows.
/// \param refused  as `stands`.
/// \return the winners, in the order in which they were found
std::vector<Polished> choose_winners(const SceneFeatures& features, const SceneDepth& scene,
                                     std::span<const Part> parts, std::vector<PoseCandidate> candidates,
                                     Standing& stands, Refused& refused, WorkBudget& budget,
                                     std::vector<Reason>& rejected);

}  // namespace tribin
