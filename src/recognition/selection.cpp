#include "selection.hpp"

#include <algorithm>
#include <cmath>

#include "likelihood.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

// Two candidates that explain more than this share of the smaller one's cells cannot both be there: touching parts
// share only cells along their common edge.
constexpr double kOverlap = 0.3;

double overlap(const CellMask& a, const CellMask& b) {
  const int smaller = std::min(a.count, b.count);
  return smaller > 0 ? double(a.shared(b)) / smaller : 0;
}

/// Share of the cells a pose explains that are no background: a face that lies in a wall or a floor is seen nowhere.
/// What has no surfel, an edge or a hole, is nobody's.
double own_share(const CellMask& mask, const Image<std::uint8_t>& background, const Image<std::int32_t>& surfel) {
  int all = 0, own = 0;
  for (std::size_t i = 0; i < background.size(); ++i) {
    if (!mask.holds(i) || surfel.data[i] < 0) continue;
    ++all;
    own += !background.data[i];
  }
  return all > 0 ? double(own) / all : 0;
}

/// A place of the scan and the poses that want it.
struct Place {
  std::vector<std::size_t> rivals;      ///< candidates, the best first: two of each part at most
  std::vector<std::vector<Pose>> also;  ///< what else was found here, of each part
  CellMask cells;                       ///< that any of the rivals explains

  std::vector<Polished> polished;
  Ranking ranking;                   ///< of `polished`
  std::vector<std::size_t> refused;  ///< rivals that their own surface or outline refuses
  std::vector<Reason> rejected;
};

/// The candidates of one call, and what of them is still open.
struct Field {
  std::vector<PoseCandidate> candidates;  ///< best first
  std::vector<CellMask> masks;
  std::vector<bool> done;
};

/// The rivals for the place of candidate i: the best two of each part that are not far behind, and as many more poses
/// as the polish can look at.
Place place_of_candidate(const Field& field, std::size_t i, std::size_t parts) {
  constexpr int kLookedAt = 6;
  Place place;
  place.also.resize(parts);
  std::vector<int> taken(parts, 0);
  for (std::size_t k = i; k < field.candidates.size(); ++k) {
    const PoseCandidate& c = field.candidates[k];
    if (field.done[k] || c.verification.gain < 0.8 * field.candidates[i].verification.gain) continue;
    const auto of = static_cast<std::size_t>(c.part);
    if (taken[of] >= kLookedAt || (k != i && overlap(field.masks[i], field.masks[k]) < 0.5)) continue;
    if (++taken[of] > 1) place.also[of].push_back(c.camera_from_part);
    if (taken[of] > 2) continue;
    place.rivals.push_back(k);
    place.cells.join(field.masks[k]);
  }
  return place;
}

/// Fits, polishes and ranks the rivals of a place.
/// \param hidden  poses that show too little to be answers, but may be likelier than what wants their cells.
void settle(const SceneDepth& scene, std::span<const Part> parts, const Field& field, std::span<const Polished> hidden,
            Place& place) {
  std::vector<const Polished*> here;
  for (const Polished& h : hidden)
    if (overlap(h.mask, place.cells) > kOverlap) here.push_back(&h);
  for (const Polished* h : here)
    place.also[static_cast<std::size_t>(h->candidate.part)].push_back(h->candidate.camera_from_part);
  std::vector<std::size_t> hopefuls;
  for (const std::size_t k : place.rivals) {
    const PoseCandidate& c = field.candidates[k];
    (hopeful(parts[static_cast<std::size_t>(c.part)], c, place.rejected) ? hopefuls : place.refused).push_back(k);
  }
  std::vector<PoseCandidate> settled(hopefuls.size());
  std::vector<std::vector<Reason>> hopeless(hopefuls.size());
  parallel_each(static_cast<int>(hopefuls.size()), [&](int i) {
    const auto r = static_cast<std::size_t>(i);
    const PoseCandidate& c = field.candidates[hopefuls[r]];
    const Part& part = parts[static_cast<std::size_t>(c.part)];
    settled[r] = looked_at_closely(scene, part, c);
    if (hopeful(part, settled[r], hopeless[r])) settled[r] = settled_on_scan(scene, part, c);
  });
  for (std::size_t r = 0; r < settled.size(); ++r) {
    for (const Reason& reason : hopeless[r]) add_reason(place.rejected, reason);
    if (!hopeless[r].empty()) {
      place.refused.push_back(hopefuls[r]);
      continue;
    }
    const PoseCandidate& c = settled[r];
    const auto of = static_cast<std::size_t>(c.part);
    const bool twin = std::any_of(place.polished.begin(), place.polished.end(),
                                  [&](const Polished& p) { return p.candidate.part == c.part; });
    if (!plausible(parts[of], c, place.rejected)) {
      place.refused.push_back(hopefuls[r]);
    } else if (!twin) {  // of one part, the polish itself tries the poses that are mistaken for each other
      place.polished.push_back(polish(scene, parts, c, place.also[of]));
    }
  }
  if (place.polished.empty()) return;
  for (const Polished* h : here)
    if (std::none_of(place.polished.begin(), place.polished.end(),
                     [&](const Polished& p) { return p.candidate.part == h->candidate.part; }))
      place.polished.push_back(*h);
  std::vector<std::pair<const Part*, Pose>> poses;
  for (const Polished& p : place.polished)
    poses.emplace_back(&parts[static_cast<std::size_t>(p.candidate.part)], p.candidate.camera_from_part);
  place.ranking = rank_poses(scene, Detail::full, poses, step_for(*poses[0].first, scene, poses[0].second, 6000));
}

}  // namespace

bool Refused::holds(std::span<const Part> parts, const PoseCandidate& c) const {
  const Part& part = parts[static_cast<std::size_t>(c.part)];
  return std::any_of(candidates.begin(), candidates.end(), [&](const PoseCandidate& r) {
    return r.part == c.part &&
           close_poses(part, r.camera_from_part, c.camera_from_part, 0.015 * part.diameter_mm, 3 * kDegree);
  });
}

bool Standing::in_place_of(std::span<const Part> parts, const PoseCandidate& c) const {
  const Part& part = parts[static_cast<std::size_t>(c.part)];
  return std::any_of(candidates.begin(), candidates.end(), [&](const PoseCandidate& s) {
    return s.part == c.part && (place_of(part, s) - place_of(part, c)).norm() < 0.02 * part.diameter_mm;
  });
}

std::vector<Polished> choose_winners(const SceneFeatures& features, const SceneDepth& scene,
                                     std::span<const Part> parts, std::vector<PoseCandidate> candidates,
                                     Standing& stands, Refused& refused, WorkBudget& budget,
                                     std::vector<Reason>& rejected) {
  Field field;
  std::erase_if(candidates, [&](const PoseCandidate& c) { return refused.holds(parts, c); });
  // What has more against it than for it is no candidate.
  std::erase_if(candidates, [](const PoseCandidate& c) { return c.verification.gain <= 0; });
  std::stable_sort(candidates.begin(), candidates.end(), [](const PoseCandidate& a, const PoseCandidate& b) {
    return a.verification.gain > b.verification.gain;
  });
  field.candidates = std::move(candidates);
  field.done.assign(field.candidates.size(), false);
  field.masks.resize(field.candidates.size());
  parallel_each(static_cast<int>(field.candidates.size()), [&](int i) {
    const PoseCandidate& c = field.candidates[static_cast<std::size_t>(i)];
    field.masks[static_cast<std::size_t>(i)] = mask_of(parts[static_cast<std::size_t>(c.part)], scene, c);
  });

  CellMask claimed = features.claimed;  // and by this round's winners
  std::vector<Polished> winners;
  const auto part_of = [&](const PoseCandidate& c) -> const Part& { return parts[static_cast<std::size_t>(c.part)]; };
  const auto taken = [&](const PoseCandidate& c, const CellMask& mask) {
    const double share = overlap(claimed, mask);
    if (mask.count > 0 && share <= kOverlap && !stands.in_place_of(parts, c)) return false;
    add_reason(rejected, {part_of(c).name, "selection", "overlap", share, kOverlap, 1, place_of(part_of(c), c)});
    return true;
  };
  while (true) {
    // Places that share no cell with any better one cannot take anything from each other. So many at a time keep the
    // cores busy; how many there are must not depend on the cores.
    constexpr std::size_t kAtATime = 4;
    constexpr int kMostWaiting = 16;  // behind so many there is hardly a place that is free
    int waiting = 0;
    std::vector<Place> places;
    CellMask wanted;  // by what is better: of this wave, or waiting for it
    for (std::size_t i = 0; i < field.candidates.size() && places.size() < kAtATime && waiting < kMostWaiting; ++i) {
      if (field.done[i]) continue;
      if (taken(field.candidates[i], field.masks[i])) {
        field.done[i] = true;
        continue;
      }
      if (wanted.shared(field.masks[i]) > 0) {
        wanted.join(field.masks[i]);
        ++waiting;
        continue;
      }
      Place place = place_of_candidate(field, i, parts.size());
      const bool waits = wanted.shared(place.cells) > 0;
      wanted.join(place.cells);
      if (waits) {
        ++waiting;
        continue;
      }
      if (!budget.take()) break;
      for (const std::size_t k : place.rivals) field.done[k] = true;
      places.push_back(std::move(place));
    }
    if (places.empty()) break;
    const double begun_ms = budget.elapsed_ms();
    parallel_each(static_cast<int>(places.size()),
                  [&](int i) { settle(scene, parts, field, refused.hidden, places[static_cast<std::size_t>(i)]); });
    const double took_ms = (budget.elapsed_ms() - begun_ms) / static_cast<double>(places.size());

    for (Place& place : places) {
      for (const Reason& reason : place.rejected) add_reason(rejected, reason);
      for (const std::size_t k : place.refused) refused.candidates.push_back(field.candidates[k]);
      if (place.polished.empty()) continue;
      Polished& winner = place.polished[place.ranking.order[0]];
      const Part& part = part_of(winner.candidate);
      const auto own_surface = [&] {
        const double own = winner.candidate.verification.measured_fraction() *
                           own_share(winner.mask, background_cells(features, part), features.surfels->surfel_of_cell);
        if (own < kLeastMeasured)
          add_reason(rejected, {part.name, "verification", "own_surface", own, kLeastMeasured, 1,
                                place_of(part, winner.candidate)});
        return own >= kLeastMeasured;
      };
      if (!acceptable(part, winner.candidate, rejected) || !own_surface()) {
        for (const std::size_t k : place.rivals) refused.candidates.push_back(field.candidates[k]);
        if (shows_too_little(part, winner.candidate)) refused.hidden.push_back(std::move(winner));
        continue;
      }
      if (taken(winner.candidate, winner.mask)) continue;
      for (std::size_t r = 1; r < place.ranking.order.size(); ++r) {
        const Polished& loser = place.polished[place.ranking.order[r]];
        const Part& other = part_of(loser.candidate);
        winner.class_odds += std::exp(place.ranking.log_odds[r]);
        add_reason(rejected, {other.name, "selection", "log_odds", place.ranking.log_odds[r], 0, 1,
                              place_of(other, loser.candidate)});
      }
      claimed.join(winner.mask);
      stands.candidates.push_back(winner.candidate);
      winners.push_back(std::move(winner));
      budget.found_one(took_ms);
    }
  }
  return winners;
}

}  // namespace tribin
