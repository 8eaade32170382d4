#include "answer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "instance_report.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/pose/index_render.hpp"
#include "weak_directions.hpp"

namespace tribin {
namespace {

/// Probability that an accepted verification is right in place and class. \source ours: a logistic of the support, the
/// outline's breaks, the share that is measured, and how much outline there is (pixels of the polish's render, a
/// hundred at most), fitted to 308 answers in 24 simulated heaps of ten parts, 17 of them wrong; rounded, and 0.6
/// milder than the fit, because the one real depth camera that we have truth of (mp6d) blurs outlines more than the
/// simulator does. Not calibrated on scenes of its own yet.
double probability(const Verification& v) {
  // Few samples of an outline say little: they count beside eight of the mean of right poses.
  const double contour = (v.outline_breaks + 8 * 0.97) / (v.outline + 8);
  // Flying pixels let a hundredth of a right pose be looked through at most; each further one costs half a nat.
  const double looked_through = std::max(0.0, v.free_space() - 0.015);
  const double x = 18 * v.support() + 15 * contour + 2 * std::log(std::max(1e-3, v.measured_fraction())) +
                   2 * std::log10(1 + std::min(100, v.outline)) - 29.4 - 50 * looked_through;
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

/// Of a patch that the fit counted, the information is part of what holds the pose: it cannot know its own distance
/// better than by itself. Where a patch would (a narrow face seen aslant, whose pixels the fit's smaller patches leave
/// out), the pose does not follow it, and its errors are none of the pose's.
void erase_what_holds_nothing(const Matrix6& held, std::vector<ErrorPatch>& patches) {
  constexpr double kSelf = 1.1;  // sums in float, and a free direction's share
  std::erase_if(patches, [&](const ErrorPatch& patch) {
    return patch.pull.dot(Vector6(held * patch.pull)) > kSelf * patch.weight;
  });
}

}  // namespace

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
  const Matrix6 held = noise_covariance(part, out.refined);
  erase_what_holds_nothing(held, out.errors.patches);
  out.field = field_variance(out.errors.patches, held, 6 - static_cast<int>(options.frozen.size()));
  return out;
}

double common_variance(std::span<const LastWord> all) {
  double sum = 0, weight = 0;
  for (const LastWord& w : all) {
    sum += w.field.patches * w.field.mm2;
    weight += w.field.patches;
  }
  return weight > 0 ? sum / weight : 0;
}

void score_again(Answer& answer) {
  Instance& out = answer.instance;
  const double before = std::exchange(out.score, answer.place * answer.held * share_of_first(out));
  if (out.p_within_tolerance && before > 0) *out.p_within_tolerance *= out.score / before;
}

Answer make_answer(const Polished& p, const LastWord& last, double shared_mm2, const Part& part,
                   const RecognitionOptions& recognition) {
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
  score_again(answer);
  if (recognition.tolerance_mm > 0 || recognition.tolerance_rad > 0) {
    double within = out.score;
    if (recognition.tolerance_mm > 0) within *= probability_below(recognition.tolerance_mm, place);
    if (recognition.tolerance_rad > 0) within *= probability_below(recognition.tolerance_rad, turn);
    out.p_within_tolerance = within;
  }
  return answer;
}

}  // namespace tribin
