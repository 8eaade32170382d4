#include "tribin/recognition/recognize.hpp"

#include <algorithm>
#include <cmath>

#include "budget.hpp"
#include "choice.hpp"
#include "instance_report.hpp"
#include "likelihood.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/pose/index_render.hpp"
#include "tribin/pose/systematic_error.hpp"
#include "tribin/recognition/bin.hpp"
#include "weak_directions.hpp"

namespace tribin {
namespace {

// Two candidates that explain more than this share of the smaller one's cells cannot both be there: touching parts
// share only cells along their common edge.
constexpr double kOverlap = 0.3;

// Given out is what is more likely right than wrong, in full pose; a place that is sure but not which of its
// self-similar poses is told apart from them.
constexpr double kGivenOut = 0.5;

double overlap(const CellMask& a, const CellMask& b) {
  const int smaller = std::min(a.count, b.count);
  return smaller > 0 ? double(a.shared(b)) / smaller : 0;
}

/// Probability that an accepted verification is right in place and class. \source ours: a logistic of the support, the
/// outline's breaks, the share that is measured, and how much outline there is (pixels of the polish's render, a
/// hundred at most), fitted to 308 answers in 24 simulated heaps of ten parts, 17 of them wrong; rounded, and 0.6
/// milder than the fit, because the one real depth camera that we have truth of (mp6d) blurs outlines more than the
/// simulator does. Not calibrated on scenes of its own yet.
double probability(const Verification& v) {
  // Few samples of an outline say little: they count beside eight of the mean of right poses.
  const double contour = (v.outline_breaks + 8 * 0.97) / (v.outline + 8);
  const double x = 18 * v.support() + 15 * contour + 2 * std::log(std::max(1e-3, v.measured_fraction())) +
                   2 * std::log10(1 + std::min(100, v.outline)) - 29.4;
  return 1 / (1 + std::exp(-x));
}

/// Probability that a 3-D error of rms length `rms` stays below a limit: Maxwell's distribution, its axes taken as
/// equal.
double probability_below(double limit, double rms) {
  if (!(rms > 0)) return 1;
  const double x = limit * std::sqrt(3.0) / rms;
  return std::erf(x / std::sqrt(2.0)) - std::sqrt(2 / kPi) * x * std::exp(-0.5 * x * x);
}

/// Root mean squares of the errors that the covariance predicts: of the box centre's place [mm], and of the rotation
/// [rad].
std::pair<double, double> predicted_errors(const Part& part, const Instance& instance) {
  const Eigen::Matrix<double, 6, 6> c = instance.covariance;
  const Eigen::Vector3d arm = instance.camera_from_part.linear() * Eigen::Vector3d(part.box_center());
  Eigen::Matrix<double, 3, 6> j = Eigen::Matrix<double, 3, 6>::Zero();
  j.leftCols<3>().setIdentity();
  j.rightCols<3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  return {std::sqrt((j * c * j.transpose()).trace()), std::sqrt(c.bottomRightCorner<3, 3>().trace())};
}

/// What the alternatives leave to the pose that is told.
double share_of_first(const Instance& instance) {
  double share = 1;
  for (const Alternative& a : instance.alternatives) share -= a.probability;
  return share;
}

Instance make_instance(const Polished& p, std::span<const Part> parts, const SceneDepth& scene,
                       const NoiseProfile& noise, const RecognitionOptions& recognition) {
  const Part& part = parts[static_cast<std::size_t>(p.candidate.part)];
  Instance out;
  out.part = part.name;
  // The last word: every pixel, up to 60 000 (more gain nothing against systematic terms), and every second one where
  // the noise is so correlated that its neighbours repeat it (neighbour correlation over 0.6).
  const int step =
      std::max(scene.correlation_px >= 0.7 ? 2 : 1, step_for(part, scene, p.candidate.camera_from_part, 60000));
  RefineOptions options = refine_options(part, step, 3, std::max(0.002 * part.diameter_mm, 4 * scene.median_sigma_mm));
  options.outlines = true;
  options.frozen = free_directions_about_center(part, p.candidate.camera_from_part);
  Refinement refined = refine_guarded(part, scene, p.candidate.camera_from_part, options);
  settle_weak_directions(part, scene, options.frozen,
                         std::max(step, step_for(part, scene, p.candidate.camera_from_part, 10000)), refined);
  out.camera_from_part = refined.camera_from_part;
  const Vec3 center(out.camera_from_part * part.box_center());
  thread_local IndexRender render;
  render_index(part.render_mesh, scene.camera, out.camera_from_part, step, render);
  const Matrix6 pull = pull_of_systematic_errors(render, scene, noise, center, options.cad_sigma_mm);
  const Matrix6 patches = pull_of_patches(render, scene, center, options.cad_sigma_mm);
  describe_uncertainty(part, pull, patches, refined, out);

  // Self-similar poses: those that keep 1 % are told.
  double sum = 1;
  for (const auto& [pose, log_odds] : p.others) sum += std::exp(log_odds);
  for (const auto& [pose, log_odds] : p.others) {
    const double probability = std::exp(log_odds) / sum;
    if (probability < 0.01) continue;
    Alternative a;
    a.camera_from_part = pose;
    a.probability = probability;
    a.decided_by = "the surface where the two poses differ";
    out.alternatives.push_back(a);
  }
  for (std::size_t i = 1; i < part.symmetry.discrete.size(); ++i)
    out.equivalent_poses.push_back(out.camera_from_part * part.symmetry.discrete[i]);
  const Verification& v = p.candidate.verification;
  out.visible_fraction = v.visible_fraction();
  const auto [place, turn] = predicted_errors(part, out);
  // "Found" is 5 % of the diameter at the rim, half a diameter from the centre.
  out.score = probability(v) *
              probability_below(0.05 * part.diameter_mm, std::hypot(place, turn * 0.5 * part.diameter_mm)) *
              (share_of_first(out) / (1 + p.class_odds));
  if (recognition.tolerance_mm > 0 || recognition.tolerance_rad > 0) {
    double within = out.score;
    if (recognition.tolerance_mm > 0) within *= probability_below(recognition.tolerance_mm, place);
    if (recognition.tolerance_rad > 0) within *= probability_below(recognition.tolerance_rad, turn);
    out.p_within_tolerance = within;
  }
  return out;
}

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

/// Poses that were looked at closely and refused: later rounds need not look again, since what is refused by its own
/// surface and outline is so whatever else the scan holds.
struct Refused {
  std::vector<PoseCandidate> candidates;

  bool holds(std::span<const Part> parts, const PoseCandidate& c) const {
    const Part& part = parts[static_cast<std::size_t>(c.part)];
    return std::any_of(candidates.begin(), candidates.end(), [&](const PoseCandidate& r) {
      return r.part == c.part &&
             close_poses(part, r.camera_from_part, c.camera_from_part, 0.015 * part.diameter_mm, 3 * kDegree);
    });
  }
};

/// What stands already. Two of a part cannot stand in one place, in whatever turn: not nearer than the thinnest sheets
/// nest, a fiftieth of their diameter.
struct Standing {
  std::vector<PoseCandidate> candidates;

  bool in_place_of(std::span<const Part> parts, const PoseCandidate& c) const {
    const Part& part = parts[static_cast<std::size_t>(c.part)];
    return std::any_of(candidates.begin(), candidates.end(), [&](const PoseCandidate& s) {
      return s.part == c.part && (place_of(part, s) - place_of(part, c)).norm() < 0.02 * part.diameter_mm;
    });
  }
};

/// Share of the cells a pose explains that are no background: a face that lies in a wall or a floor is seen nowhere.
double own_share(const CellMask& mask, const Image<std::uint8_t>& background) {
  if (mask.count == 0) return 0;
  int own = 0;
  for (std::size_t i = 0; i < background.size(); ++i) own += mask.holds(i) && !background.data[i];
  return double(own) / mask.count;
}

/// Best first: each place of the scan goes to the pose, of any part, that explains it best.
/// \param stands  what earlier rounds found; grows.
std::vector<Polished> choose(const SceneFeatures& features, const SceneDepth& scene, std::span<const Part> parts,
                             std::vector<PoseCandidate> candidates, Standing& stands, Refused& refused,
                             WorkBudget& budget, std::vector<Reason>& rejected) {
  std::erase_if(candidates, [&](const PoseCandidate& c) { return refused.holds(parts, c); });
  std::stable_sort(candidates.begin(), candidates.end(), [](const PoseCandidate& a, const PoseCandidate& b) {
    return a.verification.gain > b.verification.gain;
  });
  std::vector<CellMask> masks(candidates.size());
  parallel_each(static_cast<int>(candidates.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    masks[k] = mask_of(parts[static_cast<std::size_t>(candidates[k].part)], scene, candidates[k]);
  });
  CellMask claimed = features.claimed;  // and by this round's winners
  std::vector<Polished> winners;
  std::vector<bool> done(candidates.size(), false);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (done[i]) continue;
    if (candidates[i].verification.gain <= 0) break;  // more speaks against it and all that follow than for them
    if (masks[i].count == 0 || overlap(claimed, masks[i]) > kOverlap || stands.in_place_of(parts, candidates[i])) {
      done[i] = true;
      const Part& part = parts[static_cast<std::size_t>(candidates[i].part)];
      add_reason(rejected, {part.name, "selection", "overlap", overlap(claimed, masks[i]), kOverlap, 1,
                            place_of(part, candidates[i])});
      continue;
    }
    if (!budget.take()) break;
    const double begun_ms = budget.elapsed_ms();
    // The rivals for this place: the best two of each part that are not far behind, and as many more poses as the
    // polish can look at.
    constexpr int kLookedAt = 6;
    std::vector<std::size_t> rivals;
    std::vector<int> taken(parts.size(), 0);
    std::vector<std::vector<Pose>> also(parts.size());  // what else was found here, of each part
    for (std::size_t k = i; k < candidates.size(); ++k) {
      if (done[k] || candidates[k].verification.gain < 0.8 * candidates[i].verification.gain) continue;
      const auto of = static_cast<std::size_t>(candidates[k].part);
      if (taken[of] >= kLookedAt || (k != i && overlap(masks[i], masks[k]) < 0.5)) continue;
      if (++taken[of] > 1) also[of].push_back(candidates[k].camera_from_part);
      if (taken[of] <= 2) rivals.push_back(k);
    }
    for (const std::size_t k : rivals) done[k] = true;
    std::erase_if(rivals, [&](std::size_t k) {
      if (hopeful(parts[static_cast<std::size_t>(candidates[k].part)], candidates[k], rejected)) return false;
      refused.candidates.push_back(candidates[k]);
      return true;
    });
    std::vector<PoseCandidate> settled(rivals.size());
    parallel_each(static_cast<int>(rivals.size()), [&](int r) {
      const PoseCandidate& c = candidates[rivals[static_cast<std::size_t>(r)]];
      settled[static_cast<std::size_t>(r)] = settled_on_scan(scene, parts[static_cast<std::size_t>(c.part)], c);
    });
    std::vector<Polished> polished;
    for (std::size_t r = 0; r < rivals.size(); ++r) {
      const PoseCandidate& c = settled[r];
      const bool twin =
          std::any_of(polished.begin(), polished.end(), [&](const Polished& p) { return p.candidate.part == c.part; });
      if (plausible(parts[static_cast<std::size_t>(c.part)], c, rejected)) {
        // Of one part, the polish itself tries the poses that are mistaken for each other.
        if (!twin) polished.push_back(polish(scene, parts, c, also[static_cast<std::size_t>(c.part)]));
      } else {
        refused.candidates.push_back(candidates[rivals[r]]);
      }
    }
    if (polished.empty()) continue;
    std::vector<std::pair<const Part*, Pose>> poses;
    for (const Polished& p : polished)
      poses.emplace_back(&parts[static_cast<std::size_t>(p.candidate.part)], p.candidate.camera_from_part);
    const Ranking ranking = rank_poses(scene, poses, step_for(*poses[0].first, scene, poses[0].second, 6000));
    const std::size_t best = ranking.order[0];
    Polished& winner = polished[best];
    const Part& part = parts[static_cast<std::size_t>(winner.candidate.part)];
    const auto own_surface = [&] {
      const double own =
          winner.candidate.verification.measured_fraction() * own_share(winner.mask, background_cells(features, part));
      if (own < kLeastMeasured)
        add_reason(rejected, {part.name, "verification", "own_surface", own, kLeastMeasured, 1,
                              place_of(part, winner.candidate)});
      return own >= kLeastMeasured;
    };
    if (!acceptable(part, winner.candidate, rejected) || !own_surface() ||
        stands.in_place_of(parts, winner.candidate)) {
      for (const std::size_t k : rivals) refused.candidates.push_back(candidates[k]);
      continue;
    }
    for (std::size_t r = 1; r < ranking.order.size(); ++r) {
      const Polished& loser = polished[ranking.order[r]];
      const Part& other = parts[static_cast<std::size_t>(loser.candidate.part)];
      winner.class_odds += std::exp(ranking.log_odds[r]);
      add_reason(rejected,
                 {other.name, "selection", "log_odds", ranking.log_odds[r], 0, 1, place_of(other, loser.candidate)});
    }
    claimed.join(winner.mask);
    stands.candidates.push_back(winner.candidate);
    winners.push_back(std::move(winner));
    budget.found_one(begun_ms);
  }
  return winners;
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

  Image<std::uint8_t> in_bin;
  if (options.bin != nullptr) {
    in_bin = cells_inside(*options.bin, surfels);
    claim_cells(features, all_but(in_bin));
  }
  WorkBudget budget(options.time_limit_ms, options.work_limit);
  Refused refused;
  Standing stands;
  std::vector<Polished> found;
  // Rounds on what is left: primitives first, as long as they lead to parts; then pairs of points.
  for (const Source source : {Source::primitives, Source::point_pairs}) {
    constexpr int kRounds = 8;  // each round takes at least one part of those that touch or hide each other
    for (int round = 0; round < kRounds; ++round) {
      if (budget.exhausted()) break;
      std::vector<PoseCandidate> candidates;
      for (std::size_t i = 0; i < parts.size() && budget.take(); ++i) {
        const std::vector<PoseCandidate> of_part =
            find_candidates(features, scene, parts[i], static_cast<int>(i), source, out.rejected);
        candidates.insert(candidates.end(), of_part.begin(), of_part.end());
      }
      std::vector<Polished> winners =
          choose(features, scene, parts, std::move(candidates), stands, refused, budget, out.rejected);
      for (Polished& w : winners) {
        claim_cells(features, w.mask);
        found.push_back(std::move(w));
      }
      if (winners.empty()) break;
    }
  }
  out.time_limit = budget.exhausted();
  out.work_done = budget.done();
  decide_together(scene, parts, found);
  CellMask told;  // cells of the parts that are told of; what is kept back explains nothing
  for (const Polished& p : found) {
    Instance instance = make_instance(p, parts, scene, surfels.scan->noise, options);
    const auto kept_back = [&](const char* test, double value, double limit) {
      add_reason(out.rejected, {instance.part, "acceptance", test, value, limit, 1,
                                place_of(parts[static_cast<std::size_t>(p.candidate.part)], p.candidate)});
    };
    if (const double sure = instance.score / share_of_first(instance); sure < kGivenOut) {
      kept_back("probability", sure, kGivenOut);
      continue;
    }
    told.join(p.mask);
    if (instance.score < kGivenOut) {
      kept_back("self_similar", instance.score, kGivenOut);
      out.uncertain.push_back(std::move(instance));
    } else if (instance.p_within_tolerance && *instance.p_within_tolerance < kGivenOut) {
      kept_back("tolerance", *instance.p_within_tolerance, kGivenOut);
      out.uncertain.push_back(std::move(instance));
    } else {
      out.items.push_back(std::move(instance));
    }
  }
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
