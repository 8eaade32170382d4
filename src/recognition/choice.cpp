#include "choice.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "likelihood.hpp"
#include "rivals.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/pose/index_render.hpp"

namespace tribin {
namespace {

// Pixels that poses which stay near each other are decided on.
constexpr double kDecidePixels = 40000;

struct Finalist {
  Pose pose = Pose::Identity();
  double log_likelihood = 0;              ///< against the likeliest, once ranked
  Matrix6 information = Matrix6::Zero();  ///< of its refinement
};

void refine(const SceneDepth& scene, const Part& part, Detail detail, int step, int iterations, double start_mm,
            std::span<Finalist> finalists) {
  RefineOptions options = refine_options(part, detail, step, iterations, std::max(start_mm, 4 * scene.median_sigma_mm));
  options.outlines = true;
  parallel_each(static_cast<int>(finalists.size()), [&](int i) {
    Finalist& f = finalists[static_cast<std::size_t>(i)];
    const Refinement refined = refine_guarded(part, detail, scene, f.pose, options);
    f.pose = refined.camera_from_part;
    f.information = refined.information;
  });
}

/// The likeliest first.
void rank(const SceneDepth& scene, const Part& part, Detail detail, int step, std::vector<Finalist>& finalists) {
  std::vector<std::pair<const Part*, Pose>> poses;
  for (const Finalist& f : finalists) poses.emplace_back(&part, f.pose);
  const Ranking ranking = rank_poses(scene, detail, poses, step);
  std::vector<Finalist> ranked;
  for (std::size_t i = 0; i < ranking.order.size(); ++i) {
    ranked.push_back(finalists[ranking.order[i]]);
    ranked.back().log_likelihood = ranking.log_odds[i];
  }
  finalists = std::move(ranked);
}

/// Only those that are near the first.
void drop_unlikely(double behind, std::vector<Finalist>& finalists) {
  std::erase_if(finalists,
                [least = finalists[0].log_likelihood - behind](const Finalist& f) { return f.log_likelihood < least; });
}

constexpr std::ptrdiff_t kEven = 8;

/// Where so many poses are even, what would tell them apart is not in view: more pixels would not show it.
bool nothing_tells(const std::vector<Finalist>& finalists) {
  return std::count_if(finalists.begin(), finalists.end(), [](const Finalist& f) { return f.log_likelihood > -1; }) >=
         kEven;
}

/// Settles poses that nothing tells apart: the first, and of each other side of a nearly round part one. The rest are
/// these, turned: beside a pose that alone is settled to the noise they would look worse than they are.
void settle_even(const SceneDepth& scene, const Part& part, int step, std::span<Finalist> finalists) {
  const SymmetryGroup round = {{}, part.nearly_round};
  std::vector<std::size_t> settled;
  std::vector<Pose> before;
  for (std::size_t i = 0; i < finalists.size(); ++i) {
    Finalist& f = finalists[i];
    const auto same = std::find_if(before.begin(), before.end(), [&](const Pose& pose) {
      return same_placing(part, round, pose, f.pose, 0.02 * part.diameter_mm, 4 * kDegree);
    });
    if (part.nearly_round.size() == 1 && same != before.end()) {
      const ContinuousSymmetry& axis = part.nearly_round[0];
      const Finalist& side = finalists[settled[static_cast<std::size_t>(same - before.begin())]];
      f.pose = turned(side.pose, axis, angle_about(axis, same->inverse() * f.pose));
      f.information = side.information;
      continue;
    }
    settled.push_back(i);
    before.push_back(f.pose);
    refine(scene, part, Detail::full, step, 5, 0.012 * part.diameter_mm, std::span(&f, 1));
  }
}

}  // namespace

CellMask mask_of(const Part& part, const SceneDepth& scene, const PoseCandidate& candidate) {
  const Image<Vec3f>& cells = scene.cell_normal;
  CellMask mask = CellMask::none_of(cells.size());
  IndexRender render;
  render_index(part.coarse_mesh, scene.camera, candidate.camera_from_part, scene.cell_px, render);
  const double near_mm = 0.02 * part.diameter_mm;
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::size_t k = render.index(i, j);
      if (render.triangle[k] < 0) continue;
      const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0) || std::abs(z - 1 / render.inverse_z[k]) > near_mm + 5 * scene.sigma_mm(u, v)) continue;
      const int cu = u / scene.cell_px, cv = v / scene.cell_px;
      if (cells.contains(cu, cv)) mask.add(cells.index(cu, cv));
    }
  return mask;
}

PoseCandidate looked_at_closely(const SceneDepth& scene, const Part& part, const PoseCandidate& candidate) {
  const int step = step_for(part, scene, candidate.camera_from_part, kPolishPixels);
  PoseCandidate out = candidate;
  out.verification = verify_pose(part.coarse_mesh, scene, candidate.camera_from_part,
                                 verification_options(part, Detail::coarse, step, 0.004 * part.diameter_mm));
  return out;
}

PoseCandidate settled_on_scan(const SceneDepth& scene, const Part& part, const PoseCandidate& candidate) {
  std::vector<Finalist> one = {{candidate.camera_from_part}};
  const int step = step_for(part, scene, candidate.camera_from_part, kPolishPixels);
  refine(scene, part, Detail::full, step, 5, 0.012 * part.diameter_mm, one);
  PoseCandidate out = candidate;
  out.camera_from_part = one[0].pose;
  out.information = one[0].information;
  out.verification = verify_pose(part.render_mesh, scene, one[0].pose,
                                 verification_options(part, Detail::full, step, 0.002 * part.diameter_mm));
  return out;
}

namespace {

// A right pose explains all that it judges but mixed pixels, what the part differs from its CAD, and what the sensor's
// errors exceed its noise. On simulated heaps right ones have support of 0.966 and more, free space up to 0.008,
// contours of 0.81 and more; a consumer depth camera (mp6d) leaves 0.89, 0.013 and 0.70. Impostors on heaps: support
// below 0.85, or contours below 0.75 on little of the part, which the score tells.
constexpr double kSupport = 0.85, kFreeSpace = 0.08, kContour = 0.65;

/// Tests of one candidate, whose value and limit are told when one fails.
struct Test {
  const Part& part;
  const PoseCandidate& candidate;
  std::vector<Reason>& rejected;

  bool fails(const char* what, double value, double limit, bool bad) const {
    if (bad) add_reason(rejected, {part.name, "verification", what, value, limit, 1, place_of(part, candidate)});
    return bad;
  }
};

/// Is enough of it seen?
bool shows_enough(const Part& part, const PoseCandidate& candidate, std::vector<Reason>& rejected) {
  const Verification& v = candidate.verification;
  const Test test{part, candidate, rejected};
  // 40 supported pixels fix a pose no better than chance does; less is not a look at a part.
  return !test.fails("pixels", v.supported, 40, v.supported < 40) &&
         !test.fails("measured_fraction", v.measured_fraction(), kLeastMeasured,
                     v.measured_fraction() < kLeastMeasured);
}

/// Does what is seen agree?
/// \param slack  share of its surface that the pose may have wrong.
bool agrees(const Part& part, const PoseCandidate& candidate, double slack, std::vector<Reason>& rejected) {
  const Verification& v = candidate.verification;
  const Test test{part, candidate, rejected};
  return !test.fails("free_space", v.free_space(), kFreeSpace + slack, v.free_space() > kFreeSpace + slack) &&
         !test.fails("support", v.support(), kSupport - slack, v.support() < kSupport - slack) &&
         !test.fails("contour", v.contour(), kContour - slack, v.contour() < kContour - slack);
}

bool keeps_limits(const Part& part, const PoseCandidate& candidate, double slack, std::vector<Reason>& rejected) {
  return shows_enough(part, candidate, rejected) && agrees(part, candidate, slack, rejected);
}

Polished polish_once(const SceneDepth& scene, std::span<const Part> parts, const PoseCandidate& settled,
                     std::span<const Pose> also) {
  const Part& part = parts[static_cast<std::size_t>(settled.part)];
  const int few = step_for(part, scene, settled.camera_from_part, kCompareFew);

  // Coarse: every rival is settled on few pixels; only those near the best are worth more. The spin search compares
  // poses that differ in small features only: it needs a place that is right to the noise.
  std::vector<Pose> poses = rivals(scene, part, settled.camera_from_part);
  add_weakest_moves(part, settled, poses);
  poses.insert(poses.end(), also.begin(), also.end());
  const std::vector<Pose> turned = spins(scene, part, settled.camera_from_part);
  poses.insert(poses.begin(), turned.begin(), turned.end());
  poses.insert(poses.begin(), settled.camera_from_part);
  std::vector<Verification> checks(poses.size());
  parallel_each(static_cast<int>(poses.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    if (k > 0) poses[k] = settled_on_few(scene, part, poses[k], few);
    checks[k] = verify_pose(part.coarse_mesh, scene, poses[k],
                            verification_options(part, Detail::coarse, few, 0.004 * part.diameter_mm));
  });
  const auto leader = std::max_element(checks.begin(), checks.end(),
                                       [](const Verification& a, const Verification& b) { return a.gain < b.gain; });
  const double best = leader->gain;
  // What no rival brings near the limits is none of them: finer steps gain a few hundredths.
  PoseCandidate hope = settled;
  hope.verification = *leader;
  std::vector<Reason> ignored;
  if (!keeps_limits(part, hope, 0.08, ignored)) {
    Polished out;
    out.candidate = hope;
    return out;
  }
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin() + 1, order.end(),
                   [&](std::size_t a, std::size_t b) { return checks[a].gain > checks[b].gain; });
  std::vector<std::size_t> keep;
  for (const std::size_t k : order) {
    if (k != 0 && checks[k].gain <= 0.85 * best) break;
    // Ways that ended in one pose are one. Nearer than this the next refinement brings them together.
    if (std::none_of(keep.begin(), keep.end(), [&](std::size_t other) {
          return close_poses(part, poses[k], poses[other], 0.004 * part.diameter_mm, 1 * kDegree);
        }))
      keep.push_back(k);
  }
  if (keep.size() > 32) keep.resize(32);
  std::vector<Finalist> finalists;
  std::vector<std::pair<const Part*, Pose>> kept;
  for (const std::size_t k : keep) {
    finalists.push_back({poses[k]});
    kept.emplace_back(&part, poses[k]);
  }
  const std::vector<double> likelihood = log_likelihoods(scene, Detail::coarse, kept, few);
  for (std::size_t i = 0; i < finalists.size(); ++i) finalists[i].log_likelihood = likelihood[i];
  std::stable_sort(finalists.begin(), finalists.end(),
                   [](const Finalist& a, const Finalist& b) { return a.log_likelihood > b.log_likelihood; });
  // Three steps on few pixels leave a quarter of what is still unexplained to the finer ones (a fifth at most, seen on
  // 70 polishes of nearly round parts).
  drop_unlikely(kUndecided - 0.25 * finalists[0].log_likelihood, finalists);

  // Fine: the survivors on more pixels. Where many stay even as they are, no fit of each would tell them apart. Else
  // they are fitted, and those that stay near the best are compared once more on all pixels.
  const int fine = step_for(part, scene, settled.camera_from_part, kPolishPixels);
  if (finalists.size() >= kEven) {
    rank(scene, part, Detail::full, fine, finalists);
    drop_unlikely(2 * kUndecided, finalists);
  }
  if (nothing_tells(finalists)) {
    settle_even(scene, part, fine, finalists);
  } else if (finalists.size() > 1) {
    refine(scene, part, Detail::full, fine, 5, 0.012 * part.diameter_mm, finalists);
    rank(scene, part, Detail::full, fine, finalists);
    drop_unlikely(kUndecided, finalists);
    if (finalists.size() > 1 && !nothing_tells(finalists)) {
      const int all = step_for(part, scene, settled.camera_from_part, kDecidePixels);
      refine(scene, part, Detail::full, all, 2, 0, finalists);
      rank(scene, part, Detail::full, all, finalists);
    }
  }

  Polished out;
  out.candidate = settled;
  out.candidate.camera_from_part = finalists[0].pose;
  if (finalists[0].information != Matrix6::Zero()) out.candidate.information = finalists[0].information;
  out.candidate.verification = verify_pose(part.render_mesh, scene, finalists[0].pose,
                                           verification_options(part, Detail::full, fine, 0.002 * part.diameter_mm));
  out.mask = mask_of(part, scene, out.candidate);
  const auto same = [&](const Pose& a, const Pose& b) {
    return close_poses(part, a, b, 0.02 * part.diameter_mm, 4 * kDegree);
  };
  for (const Finalist& f : finalists)
    if (!same(f.pose, finalists[0].pose) &&
        std::none_of(out.others.begin(), out.others.end(), [&](const auto& o) { return same(o.first, f.pose); }))
      out.others.emplace_back(f.pose, f.log_likelihood);
  return out;
}

}  // namespace

Polished polish(const SceneDepth& scene, std::span<const Part> parts, const PoseCandidate& settled,
                std::span<const Pose> also) {
  const Part& part = parts[static_cast<std::size_t>(settled.part)];
  Polished out = polish_once(scene, parts, settled, also);
  // Upside down and turned: a pose that has changed is taken for others than the one it came from, but spins among
  // themselves are taken for the same.
  constexpr int kMore = 6;  // a pose that went on where nothing compared it with its own spins looked sure
  PoseCandidate from = settled;
  for (int i = 0; i < kMore; ++i) {
    const Pose& now = out.candidate.camera_from_part;
    const auto is = [&](const Pose& pose) {
      return close_poses(part, from.camera_from_part, pose, 0.02 * part.diameter_mm, 4 * kDegree);
    };
    const bool compared = std::any_of(out.others.begin(), out.others.end(), [&](const auto& o) { return is(o.first); });
    const bool spun = std::any_of(part.nearly_round.begin(), part.nearly_round.end(), [&](const auto& line) {
      const Eigen::Vector3d axis = Eigen::Vector3d(line.axis).normalized();
      return (now.linear() * axis).dot(from.camera_from_part.linear() * axis) > std::cos(4 * kDegree);
    });
    // Spins were compared where the part is not, if it went on to explain more by so much.
    const bool was_there = part.nearly_round.empty() || from.verification.gain > 0.95 * out.candidate.verification.gain;
    if (was_there && (is(now) || (compared && spun))) break;
    from = out.candidate;
    out = polish_once(scene, parts, from, also);
  }
  return out;
}

void decide_again(const SceneDepth& scene, std::span<const Part> parts, const CellMask& elsewhere, Polished& polished) {
  if (polished.others.empty()) return;
  const Part& part = parts[static_cast<std::size_t>(polished.candidate.part)];
  std::vector<std::pair<const Part*, Pose>> poses = {{&part, polished.candidate.camera_from_part}};
  for (const auto& [pose, log_odds] : polished.others) poses.emplace_back(&part, pose);
  const Ranking ranking =
      rank_again(scene, Detail::full, poses, step_for(part, scene, poses[0].second, kDecidePixels), elsewhere);
  polished.others.clear();
  for (std::size_t i = 1; i < ranking.order.size(); ++i)
    polished.others.emplace_back(poses[ranking.order[i]].second, ranking.log_odds[i]);
  if (ranking.order[0] == 0) return;
  PoseCandidate& c = polished.candidate;
  c.camera_from_part = poses[ranking.order[0]].second;
  c.verification =
      verify_pose(part.render_mesh, scene, c.camera_from_part,
                  verification_options(part, Detail::full, step_for(part, scene, c.camera_from_part, kPolishPixels),
                                       0.002 * part.diameter_mm));
  polished.mask = mask_of(part, scene, c);
}

bool hopeful(const Part& part, const PoseCandidate& candidate, std::vector<Reason>& rejected) {
  // Few pixels and a pose a little off tell less: twice what `plausible` leaves open, and the outline's few samples two
  // standard deviations besides.
  constexpr double kSlack = 0.3;
  const Verification& v = candidate.verification;
  const Test test{part, candidate, rejected};
  const double contour = kContour - kSlack - 1 / std::sqrt(std::max(1, v.outline));
  return !test.fails("measured_fraction", v.measured_fraction(), 0.17, v.measured_fraction() < 0.17) &&
         !test.fails("free_space", v.free_space(), kFreeSpace + kSlack, v.free_space() > kFreeSpace + kSlack) &&
         !test.fails("support", v.support(), kSupport - kSlack, v.support() < kSupport - kSlack) &&
         !test.fails("contour", v.contour(), contour, v.contour() < contour);
}

bool plausible(const Part& part, const PoseCandidate& settled, std::vector<Reason>& rejected) {
  return keeps_limits(part, settled, 0.15, rejected);  // self-similar poses keep at least 85 % of the surface in place
}

bool acceptable(const Part& part, const PoseCandidate& candidate, std::vector<Reason>& rejected) {
  return keeps_limits(part, candidate, 0, rejected);
}

bool shows_too_little(const Part& part, const PoseCandidate& candidate) {
  std::vector<Reason> ignored;
  return !shows_enough(part, candidate, ignored) && agrees(part, candidate, 0, ignored);
}

}  // namespace tribin
