#include "tribin/recognition/recognize.hpp"

#include <algorithm>
#include <cmath>

#include "answer.hpp"
#include "instance_report.hpp"
#include "keep_apart.hpp"
#include "selection.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/recognition/bin.hpp"

namespace tribin {
namespace {

/// Tells of each refusal which answer its nearest miss lies next to.
void name_neighbours(std::span<const Part> parts, Instances& found) {
  for (Reason& reason : found.rejected) {
    if (!reason.at_mm) continue;
    double nearest = 0;
    for (const Instance& instance : found.items) {
      const auto part =
          std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == instance.part; });
      const double distance = (instance.camera_from_part * part->box_center() - *reason.at_mm).norm();
      if (reason.nearest_instance != 0 && distance >= nearest) continue;
      reason.nearest_instance = instance.id;
      nearest = distance;
    }
  }
}

/// The cells that are not flagged.
CellMask all_but(const Image<std::uint8_t>& flags) {
  CellMask out = CellMask::none_of(flags.size());
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (!flags.data[i]) out.add(i);
  return out;
}

/// Each part's self-similar poses are decided again, in the order in which the parts were found: the first ones were
/// when nothing was known of those that stand in front of them.
void decide_together(const SceneDepth& scene, std::span<const Part> parts, std::vector<Polished>& found) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    CellMask elsewhere;
    for (std::size_t k = 0; k < found.size(); ++k)
      if (k != i) elsewhere.join(found[k].mask);
    decide_again(scene, parts, elsewhere, found[i]);
  }
}

}  // namespace

Instances recognize(const Primitives& primitives, const PrimitiveModel& observation, const Surfels& surfels,
                    std::span<const Part> parts, const RecognitionOptions& options) {
  TRIBIN_ASSERT(surfels.scan != nullptr);
  Instances out;
  SceneDepth scene = make_scene_depth(*surfels.scan, surfels);
  SceneFeatures features = make_scene_features(primitives, observation, surfels);

  find_floors(features, parts, scene.median_sigma_mm);
  scene.floor = floor_cells(features);
  Image<std::uint8_t> in_bin;
  if (options.bin != nullptr) {
    in_bin = cells_inside(*options.bin, surfels);
    claim_cells(features, all_but(in_bin));
  }
  WorkBudget budget(options.time_limit_ms, options.work_limit);
  Refused refused;
  Standing stands;
  std::vector<Polished> found;
  std::vector<PartSearch> searches(parts.size());
  // Rounds on what is left: primitives first, as long as they lead to parts; then pairs of points.
  for (const Source source : {Source::primitives, Source::point_pairs}) {
    features.fresh.reset();
    constexpr int kRounds = 8;  // each round takes at least one part of those that touch or hide each other
    for (int round = 0; round < kRounds; ++round) {
      if (budget.exhausted()) break;
      std::vector<PoseCandidate> candidates;
      for (std::size_t i = 0; i < parts.size() && budget.take(); ++i) {
        const std::vector<PoseCandidate> of_part =
            find_candidates(features, scene, parts[i], static_cast<int>(i), source, searches[i], out.rejected);
        candidates.insert(candidates.end(), of_part.begin(), of_part.end());
      }
      std::vector<Polished> winners =
          choose_winners(features, scene, parts, std::move(candidates), stands, refused, budget, out.rejected);
      CellMask fresh;
      for (Polished& w : winners) {
        claim_cells(features, w.mask);
        fresh.join(w.mask);
        found.push_back(std::move(w));
      }
      if (winners.empty()) break;
      features.fresh = points_of(fresh, surfels);
    }
  }
  out.time_limit = budget.exhausted();
  out.work_done = budget.done();
  decide_together(scene, parts, found);
  CellMask told;  // cells of the parts that are told of; what is kept back explains nothing
  std::vector<LastWord> last(found.size());
  parallel_each(static_cast<int>(found.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const Part& part = parts[static_cast<std::size_t>(found[k].candidate.part)];
    last[k] = last_word(found[k], part, scene, surfels.scan->noise);
  });
  const double shared_mm2 = common_variance(last);
  for (std::size_t i = 0; i < found.size(); ++i) {
    Polished& p = found[i];
    if (scene.edge_blur_px > 0) {
      // What such a sensor leaves open the last word may move by more than a rim: it is looked at where it stands now.
      p.candidate.camera_from_part = last[i].refined.camera_from_part;
      const Part& part = parts[static_cast<std::size_t>(p.candidate.part)];
      p.candidate = looked_at_closely(scene, part, p.candidate);
      if (!acceptable(part, p.candidate, out.rejected)) continue;
    }
    Answer answer = make_answer(p, last[i], shared_mm2, parts[static_cast<std::size_t>(p.candidate.part)], options);
    if (options.bin != nullptr && options.bin->found && !answer.instance.alternatives.empty()) {
      strike_out_in_bin(parts[static_cast<std::size_t>(p.candidate.part)], *options.bin, answer.instance);
      score_again(answer);
    }
    Instance& instance = answer.instance;
    const auto kept_back = [&](const char* test, double value, double limit) {
      add_reason(out.rejected, {instance.part, "acceptance", test, value, limit, 1,
                                place_of(parts[static_cast<std::size_t>(p.candidate.part)], p.candidate)});
    };
    if (answer.place < kGivenOut) {
      kept_back("probability", answer.place, kGivenOut);
      continue;
    }
    told.join(p.mask);
    if (instance.score < kGivenOut) {
      if (answer.held < kGivenOut)
        kept_back("weak_direction", answer.held, kGivenOut);
      else
        kept_back("self_similar", instance.score, kGivenOut);
      out.uncertain.push_back(std::move(instance));
    } else if (instance.p_within_tolerance && *instance.p_within_tolerance < kGivenOut) {
      kept_back("tolerance", *instance.p_within_tolerance, kGivenOut);
      out.uncertain.push_back(std::move(instance));
    } else {
      out.items.push_back(std::move(instance));
    }
  }
  keep_apart(parts, scene, options.bin, out.items, out.rejected);
  int id = 0;
  for (std::vector<Instance>* list : {&out.items, &out.uncertain}) {
    std::stable_sort(list->begin(), list->end(),
                     [](const Instance& a, const Instance& b) { return a.score > b.score; });
    for (Instance& instance : *list) instance.id = ++id;
  }
  name_neighbours(parts, out);
  describe_quality(parts, scene, features, surfels.scan->noise, out);
  out.unexplained = unexplained_regions(features, parts, told, options.bin, in_bin);
  return out;
}

}  // namespace tribin
