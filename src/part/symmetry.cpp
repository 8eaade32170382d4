#include "tribin/part/symmetry.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "part/symmetry_candidates.hpp"
#include "part/symmetry_group.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

// Lengths below are shares of the part's diameter.
constexpr double kTolerance = 0.002;
constexpr double kTelling = 0.005;
constexpr double kScanReach = 0.02;    // half a step of the scan moves the rim by 1.7 %
constexpr double kPolishReach = 0.03;  // the offset of near symmetries from the centroid, and half a step
constexpr double kSameMotion = 0.03;   // rms: poses that refinement would take to one another
constexpr double kRidgeSpacing = 0.2;  // rms: enough that a search along the ridge from each meets the next
constexpr double kProminence = 0.01;   // of the overlap; 1/2000 of the surface is the sampling's own step
constexpr double kSymmetryOverlap = 0.97;
constexpr double kMostOff = 0.001;  // of the surface, further off than the telling length
constexpr double kNormalAngle = 20 * kDegree;
constexpr double kSameRotation =
    1 * kDegree;  // polished rotations are good to a tenth of that; 120 teeth are 3 deg apart
constexpr int kMostFold = 120;
constexpr std::size_t kLargestGroup = 2 * kMostFold;
constexpr int kScanSamples = 160, kPolishSamples = 300, kJudgeSamples = 2000, kStrictSamples = 12000;
constexpr std::size_t kMostPolished = 64;
constexpr std::size_t kFullyScannedAxes = 8;
constexpr std::size_t kMostTellingPoints = 400;

struct Judged {
  Pose motion = Pose::Identity();
  double overlap = 0;
};

void validate(const SymmetryOptions& o) {
  const auto wrong = [](const char* what) { throw Error(ErrorCode::bad_option, what); };
  if (!(o.tolerance_mm >= 0)) wrong("symmetry tolerance_mm must be 0 (automatic) or a length in mm");
  if (!(o.telling_mm >= 0)) wrong("symmetry telling_mm must be 0 (automatic) or a length in mm");
  if (!(o.min_overlap > 0 && o.min_overlap < 1)) wrong("symmetry min_overlap must lie between 0 and 1");
  if (o.max_self_similar < 0) wrong("symmetry max_self_similar must be 0 or more");
}

/// One search: the surface, its samples, and the lengths that count.
class Search {
 public:
  Search(const Mesh& mesh, const SymmetryOptions& options)
      : options_(options), surface_(mesh), samples_(surface_.sample(kStrictSamples)) {
    const double d = surface_.diameter_mm();
    result_.tolerance_mm = options.tolerance_mm > 0 ? options.tolerance_mm : kTolerance * d;
    result_.telling_mm = std::max(result_.tolerance_mm, options.telling_mm > 0 ? options.telling_mm : kTelling * d);
    fine_ = {result_.tolerance_mm, kNormalAngle};
    telling_ = {result_.telling_mm, kNormalAngle};
  }

  SymmetryResult run() {
    find_motions();
    follow_axes();
    collect_group();
    collect_self_similar();
    return std::move(result_);
  }

 private:
  std::span<const SurfaceSample> first(int count) const { return std::span(samples_).first(count); }

  double rms(const Pose& a, const Pose& b) const {
    return rms_between(a, b, surface_.centroid(), surface_.covariance());
  }

  bool known(const Pose& motion, double apart) const {
    if (rms(motion, Pose::Identity()) < apart) return true;
    return std::any_of(judged_.begin(), judged_.end(), [&](const Judged& j) { return rms(motion, j.motion) < apart; });
  }

  Pose polished(const Pose& motion, double reach_mm, int iterations) const {
    return polish(surface_, first(kPolishSamples), motion, reach_mm, result_.tolerance_mm, iterations);
  }

  double judge(const Pose& motion, double floor) const {
    return overlap_of(surface_, first(kJudgeSamples), motion, fine_, floor);
  }

  bool is_symmetry(const Pose& motion, int samples = kStrictSamples) const {
    if (overlap_of(surface_, first(kPolishSamples), motion, fine_, 0.95) < 0.95) return false;
    if (overlap_of(surface_, first(samples), motion, telling_, 1 - kMostOff) < 1 - kMostOff) return false;
    return overlap_of(surface_, first(samples), motion, fine_, kSymmetryOverlap) >= kSymmetryOverlap;
  }

  /// The rotation of a motion, about the point that every symmetry fixes.
  Pose about_centroid(const Matrix3& rotation) const {
    Pose pose = Pose::Identity();
    pose.linear() = rotation;
    pose.translation() = surface_.centroid() - rotation * surface_.centroid();
    return pose;
  }

  /// Polishes and keeps a motion if it is new and leaves enough in place.
  void consider(const Pose& start, double reach_mm, int iterations) {
    const Pose motion = polished(start, reach_mm, iterations);
    if (known(motion, 0.003 * surface_.diameter_mm())) return;
    const double overlap = judge(motion, options_.min_overlap);
    if (overlap >= options_.min_overlap) judged_.push_back({motion, overlap});
  }

  void sort_judged() {
    std::stable_sort(judged_.begin(), judged_.end(),
                     [](const Judged& a, const Judged& b) { return a.overlap > b.overlap; });
  }

  void find_motions() {
    const double d = surface_.diameter_mm();
    const Nearness coarse{kScanReach * d, kNormalAngle};
    const std::vector<Axis> axes = candidate_axes(surface_, first(kJudgeSamples / 2));
    std::vector<Candidate> candidates;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      if (i < kFullyScannedAxes) {
        const auto found = scan_turns(surface_, first(kScanSamples), axes[i], coarse, 0.8 * options_.min_overlap);
        candidates.insert(candidates.end(), found.begin(), found.end());
        continue;
      }
      for (const int fold : {2, 3, 4, 5, 6}) {
        const Pose motion = turn(axes[i], 2 * kPi / fold);
        const double overlap = overlap_of(surface_, first(kScanSamples), motion, coarse, options_.min_overlap);
        if (overlap >= options_.min_overlap) candidates.push_back({motion, overlap});
      }
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.overlap > b.overlap; });
    std::vector<Pose> tried;
    for (const Candidate& candidate : candidates) {
      const bool near_tried = std::any_of(tried.begin(), tried.end(), [&](const Pose& pose) {
        return rms(pose, candidate.motion) < 0.5 * kSameMotion * d;
      });
      if (near_tried || tried.size() >= kMostPolished) continue;
      tried.push_back(candidate.motion);
      consider(candidate.motion, kPolishReach * d, 8);
    }
    sort_judged();
  }

  /// Along the axes of the motions found so far, which are now well known, looks for what the coarse scan cannot tell
  /// apart: turned parts, and toothed ones with many turns.
  void follow_axes() {
    std::vector<Axis> axes;
    for (const Judged& j : judged_) {
      if (axes.size() == 3 || j.overlap < 0.8) break;
      const Axis axis = axis_of(j.motion);
      const bool same = std::any_of(axes.begin(), axes.end(), [&](const Axis& other) {
        return std::abs(other.direction.dot(axis.direction)) > std::cos(kSameRotation);
      });
      if (!same) axes.push_back(axis);
    }
    for (const Axis& axis : axes) {
      if (find_continuous(axis)) return;
      follow_folds(axis);
    }
    sort_judged();
  }

  bool turns_freely(const Axis& axis) const {
    constexpr double kGoldenAngle = 2.399963229728653;  // no small multiple of it is near a fraction of a turn
    for (int k = 1; k <= 6; ++k)
      if (!is_symmetry(turn(axis, k * kGoldenAngle))) return false;
    return true;
  }

  bool find_continuous(const Axis& start) {
    if (judge(turn(start, 1.0), 0.8) < 0.8) return false;
    // Sharpen the axis: the mean of the axes of polished turns (a mesh of uneven facets has its centroid a bit off).
    Axis axis{Vec3::Zero(), Vec3::Zero()};
    constexpr int kTurns = 4;
    for (int k = 0; k < kTurns; ++k) {
      Axis one = axis_of(polished(turn(start, 1.1 + 0.7 * k), 2 * result_.tolerance_mm, 4));
      if (one.direction.dot(start.direction) < 0) one.direction = -one.direction;
      one.point += one.direction * one.direction.dot(surface_.centroid() - one.point);
      axis.direction += one.direction / kTurns;
      axis.point += one.point / kTurns;
    }
    axis.direction.normalize();
    if (!turns_freely(axis)) {
      axis = {start.direction, surface_.centroid()};
      if (!turns_freely(axis)) return false;
    }
    Vec3 u, v;
    orthonormal_basis(axis.direction, u, v);
    if (turns_freely({u, axis.point})) {
      for (const Vec3& direction : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())})
        result_.group.continuous.push_back({direction, surface_.centroid()});
    } else {
      result_.group.continuous.push_back({axis.direction, axis.point});
      swap_ends_ = turn({u, surface_.centroid()}, kPi);
    }
    return true;
  }

  void follow_folds(const Axis& axis) {
    const auto overlap_at = [&](double angle, double floor) {
      return overlap_of(surface_, first(kPolishSamples), turn(axis, angle), fine_, floor);
    };
    int best_fold = 0;
    double best = 0.8;
    for (int fold = 5; fold <= kMostFold; ++fold) {
      const double overlap = overlap_at(2 * kPi / fold, best);
      if (overlap < best) continue;
      // A plate turned by little keeps most of itself in place, too; teeth in between do not.
      if (overlap_at(kPi / fold, 0) > overlap - 0.02) continue;
      best_fold = fold;
      best = std::max(best, overlap - 0.005);  // of equals the one with the most turns
    }
    if (best_fold == 0) return;
    const std::vector<Judged> before = judged_;
    for (int k = 1; k < best_fold; ++k) consider(turn(axis, 2 * kPi * k / best_fold), 2 * result_.tolerance_mm, 3);
    // The coarse scan finds half turns across the axis only to the nearest tooth, if that: look between two teeth.
    Vec3 u, v;
    orthonormal_basis(axis.direction, u, v);
    Candidate flip;
    const int steps =
        std::clamp(static_cast<int>(kPi * surface_.diameter_mm() / best_fold / result_.tolerance_mm), 8, 400);
    for (int i = 0; i < steps; ++i) {
      const Pose motion = turn(axis, 2 * kPi * i / best_fold / steps) * turn({u, surface_.centroid()}, kPi);
      const double overlap = overlap_of(surface_, first(kPolishSamples), motion, fine_, std::max(0.5, flip.overlap));
      if (overlap > flip.overlap) flip = {motion, overlap};
    }
    if (flip.overlap < options_.min_overlap) return;
    flip.motion = polished(flip.motion, 2 * result_.tolerance_mm, 4);
    for (int k = 0; k < best_fold; ++k)
      consider(turn(axis, 2 * kPi * k / best_fold) * flip.motion, 2 * result_.tolerance_mm, 3);
  }

  void collect_group() {
    SymmetryGroup& group = result_.group;
    group.discrete = {Pose::Identity()};
    if (!group.continuous.empty()) {
      if (group.continuous.size() == 1 && is_symmetry(swap_ends_)) group.discrete.push_back(swap_ends_);
      return;
    }
    std::vector<Matrix3> members = {Matrix3::Identity()};
    for (const Judged& j : judged_) {
      if (j.overlap < kSymmetryOverlap - 0.01) break;
      const Matrix3 rotation = j.motion.linear();
      if (index_of(members, rotation, kSameRotation) >= 0 || !is_symmetry(about_centroid(rotation))) continue;
      // One of which the products are no symmetries is none itself, however well it fits.
      std::vector<Matrix3> larger = members;
      larger.push_back(rotation);
      larger = close_group(larger, kSameRotation, kLargestGroup);
      if (larger.empty()) continue;
      larger = sharpen_group(larger, kSameRotation);
      const int samples = std::max(kJudgeSamples, kStrictSamples / static_cast<int>(larger.size()));
      const bool all = std::all_of(larger.begin() + 1, larger.end(),
                                   [&](const Matrix3& m) { return is_symmetry(about_centroid(m), samples); });
      if (all) members = larger;
    }
    for (std::size_t i = 1; i < members.size(); ++i) group.discrete.push_back(about_centroid(members[i]));
  }

  void collect_self_similar() {
    const double d = surface_.diameter_mm();
    const std::size_t most = static_cast<std::size_t>(options_.max_self_similar);
    std::vector<Pose> kept = {Pose::Identity()};
    for (const Judged& j : judged_)
      for (const Pose& motion : {j.motion, Pose(j.motion.inverse())}) {
        if (result_.self_similar.size() >= most) return;
        double nearest = d;
        for (const Pose& other : kept)
          nearest =
              std::min(nearest, rms_modulo(motion, other, result_.group, surface_.centroid(), surface_.covariance()));
        if (nearest < kSameMotion * d || (nearest < kRidgeSpacing * d && on_ridge(motion, kept))) continue;
        kept.push_back(motion);
        result_.self_similar.push_back({motion, j.overlap, discriminating_points(motion)});
      }
  }

  /// A turned part with a few features keeps most of itself in place after any turn: from each such pose there is a way
  /// to a better one on which the overlap does not drop.
  bool on_ridge(const Pose& motion, const std::vector<Pose>& better) const {
    const auto samples = first(kJudgeSamples / 2);
    const double limit = overlap_of(surface_, samples, motion, fine_) - kProminence;
    for (const Pose& other : better)
      for (const Pose& g : result_.group.discrete) {
        const Pose way = other * g * motion.inverse();
        const Vec3 w = vector_from_rotation(way.linear());
        if (w.norm() < 1 * kDegree) continue;
        const double share = std::min(1.0, kSameMotion * surface_.diameter_mm() / rms(other * g, motion));
        const Pose step = turn(axis_of(way), share * w.norm()) * motion;
        if (overlap_of(surface_, samples, step, fine_, limit) >= limit) return true;
      }
    return false;
  }

  std::vector<Vec3f> discriminating_points(const Pose& motion) const {
    const Pose inverse = motion.inverse();
    std::vector<Vec3f> points;
    for (const SurfaceSample& s : samples_) {
      if (points.size() == kMostTellingPoints) break;  // a prefix of the sequence is spread as evenly as all of it
      if (overlap_of(surface_, {&s, 1}, inverse, telling_) == 0) points.push_back(s.point.cast<float>());
    }
    return points;
  }

  SymmetryOptions options_;
  SurfaceIndex surface_;
  std::vector<SurfaceSample> samples_;
  Nearness fine_, telling_;
  std::vector<Judged> judged_;
  Pose swap_ends_ = Pose::Identity();
  SymmetryResult result_;
};

}  // namespace

SymmetryResult find_symmetries(const Mesh& mesh, const SymmetryOptions& options) {
  validate(options);
  return Search(mesh, options).run();
}

}  // namespace tribin
