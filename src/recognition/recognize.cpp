#include "tribin/recognition/recognize.hpp"

#include <algorithm>
#include <cmath>

#include "instance_report.hpp"
#include "keep_apart.hpp"
#include "selection.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/pose/index_render.hpp"
#include "tribin/pose/systematic_error.hpp"
#include "tribin/recognition/bin.hpp"
#include "weak_directions.hpp"

namespace tribin {
namespace {

// Given out is what is right two times in three, in full pose, because a grip at a wrong pose costs more than a part
// that waits for the next scan; a place that is sure but not which of its self-similar poses is told apart from them.
// Of 1478 answers in 160 unseen heaps 8 right and 7 wrong ones lie between that and an even chance.
constexpr double kGivenOut = 2.0 / 3;

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
  return {std::sqrt(motion_variance(instance, instance.camera_from_part * part.box_center())),
          std::sqrt(c.bottomRightCorner<3, 3>().trace())};
}

/// What the alternatives leave to the pose that is told.
double share_of_first(const Instance& instance) {
  double share = 1;
  for (const Alternative& a : instance.alternatives) share -= a.probability;
  return share;
}

/// An answer, and what speaks for it.
struct Answer {
  Instance instance;
  double place = 0;  ///< probability that class and place are right, whichever pose it is in there
  double held = 0;   ///< probability that the noise leaves the pose within what counts as found
};

/// The last word on a pose, and what its residuals tell of errors that pixels have in common.
struct LastWord {
  Refinement refined;
  CommonErrors errors;
  FieldVariance field;
};

LastWord last_word(const Polished& p, const Part& part, const SceneDepth& scene, const NoiseProfile& noise) {
  LastWord out;
  // Every pixel, up to 60 000 (more gain nothing against systematic terms), and every second one where
  // the noise is so correlated that its neighbours repeat it (neighbour correlation over 0.6).
  const int step =
      std::max(scene.correlation_px >= 0.7 ? 2 : 1, step_for(part, scene, p.candidate.camera_from_part, 60000));
  RefineOptions options =
      refine_options(part, Detail::full, step, 3, std::max(0.002 * part.diameter_mm, 4 * scene.median_sigma_mm));
  options.outlines = options.by_patches = true;
  options.frozen = free_directions_about_center(part, p.candidate.camera_from_part);
  out.refined = refine_guarded(part, Detail::full, scene, p.candidate.camera_from_part, options);
  settle_weak_directions(part, scene, options.frozen,
                         std::max(step, step_for(part, scene, p.candidate.camera_from_part, 10000)), out.refined);
  const Pose& pose = out.refined.camera_from_part;
  thread_local IndexRender render;
  render_index(part.render_mesh, scene.camera, pose, step, render);
  out.errors = common_errors(render, scene, noise, pose * part.box_center(), options.cad_sigma_mm);
  out.field = field_variance(out.errors.patches, noise_covariance(part, out.refined),
                             6 - static_cast<int>(options.frozen.size()));
  return out;
}

/// What patches are off by is the scene's and the sensor's as much as the part's: the mean over all that was found.
double common_variance(std::span<const LastWord> all) {
  double sum = 0, weight = 0;
  for (const LastWord& w : all) {
    sum += w.field.patches * w.field.mm2;
    weight += w.field.patches;
  }
  return weight > 0 ? sum / weight : 0;
}

/// \param shared_mm2  common_variance of the scan.
Answer make_answer(const Polished& p, const LastWord& last, double shared_mm2, std::span<const Part> parts,
                   const RecognitionOptions& recognition) {
  const Part& part = parts[static_cast<std::size_t>(p.candidate.part)];
  Answer answer;
  Instance& out = answer.instance;
  out.part = part.name;
  out.camera_from_part = last.refined.camera_from_part;
  // The scan's mean counts as much as a dozen of the part's own patches, and patches of like normals share what they
  // are off by over a fifth of the diameter (docs/recognition.md has what was measured).
  constexpr double kPrior = 12, kCorrelation = 0.2;
  const double variance = (last.field.patches * last.field.mm2 + kPrior * shared_mm2) / (last.field.patches + kPrior);
  const Matrix6 field = pull_of_field(last.errors.patches, variance, kCorrelation * part.diameter_mm);
  describe_uncertainty(part, Matrix6(field + last.errors.systematic), last.refined, out);

  // Self-similar poses: those that keep 1 % are told. Of those that nobody tells apart the likeliest stands for all:
  // how many were tried says nothing. What is nearer than what counts as found is the same answer: how far that may be
  // off, its covariance tells.
  constexpr double kSameAnswer = 0.05;  // of the diameter at the rim, half a diameter from the centre
  const SymmetryGroup same = all_symmetries(part);
  std::vector<std::pair<Pose, double>> apart;
  for (const auto& [pose, log_odds] : p.others) {
    const auto is = [&, &tried = pose](const Pose& other) {
      return same_placing(part, same, other, tried, 0.02 * part.diameter_mm, 4 * kDegree);
    };
    if (!same_placing(part, same, out.camera_from_part, pose, kSameAnswer * part.diameter_mm, 2 * kSameAnswer) &&
        std::none_of(apart.begin(), apart.end(), [&](const auto& a) { return is(a.first); }))
      apart.emplace_back(pose, log_odds);
  }
  double sum = 1;
  for (const auto& [pose, log_odds] : apart) sum += std::exp(log_odds);
  for (const auto& [pose, log_odds] : apart) {
    const double probability = std::exp(log_odds) / sum;
    if (probability < 0.01) continue;
    Alternative a;
    a.camera_from_part = pose;
    a.probability = probability;
    a.decided_by = "the surface where the two poses differ";
    out.alternatives.push_back(a);
  }
  for (std::size_t i = 1; i < same.discrete.size(); ++i)
    out.equivalent_poses.push_back(out.camera_from_part * same.discrete[i]);
  const Verification& v = p.candidate.verification;
  out.visible_fraction = v.visible_fraction();
  const auto [place, turn] = predicted_errors(part, out);
  answer.place = probability(v) / (1 + p.class_odds);
  answer.held = probability_below(kSameAnswer * part.diameter_mm, std::hypot(place, turn * 0.5 * part.diameter_mm));
  out.score = answer.place * answer.held * share_of_first(out);
  if (recognition.tolerance_mm > 0 || recognition.tolerance_rad > 0) {
    double within = out.score;
    if (recognition.tolerance_mm > 0) within *= probability_below(recognition.tolerance_mm, place);
    if (recognition.tolerance_rad > 0) within *= probability_below(recognition.tolerance_rad, turn);
    out.p_within_tolerance = within;
  }
  return answer;
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

  find_floors(features, parts);
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
    Answer answer = make_answer(p, last[i], shared_mm2, parts, options);
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
