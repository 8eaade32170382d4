#include "candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "render_scores.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/pose/look_up.hpp"

namespace tribin {
namespace {

struct Scored {
  Pose pose = Pose::Identity();
  double score = -1;
  std::size_t order = 0;
};

bool better(const Scored& a, const Scored& b) { return a.score != b.score ? a.score > b.score : a.order < b.order; }

/// The best poses, none like another, and at each place (a quarter of the diameter around) at most `most` of them: how
/// many parts the scan holds must not decide how closely each is looked at.
std::vector<Scored> best_apart(const Part& part, std::vector<Scored> all, int most, double distance, double angle) {
  std::sort(all.begin(), all.end(), better);
  const double place = 0.25 * part.diameter_mm;
  std::vector<Scored> out;
  std::vector<Vec3> centers;
  for (const Scored& s : all) {
    const Vec3 center = s.pose * part.box_center();
    int here = 0;
    bool like_another = false;
    for (std::size_t i = 0; i < out.size() && !like_another && here < most; ++i) {
      if ((centers[i] - center).squaredNorm() > place * place) continue;
      ++here;
      like_another = close_poses(part, s.pose, out[i].pose, distance, angle);
    }
    if (like_another || here >= most) continue;
    out.push_back(s);
    centers.push_back(center);
  }
  return out;
}

/// Least score of a look-up that is worth more: an eighth of the view supported, all else hidden or unmeasured.
constexpr double kKeep = 0.05;

double noise_tolerance(const SceneDepth& scene) { return 4 * scene.median_sigma_mm; }

/// \param settle  the poses are as coarse as point pairs: they are moved onto the scan first.
std::vector<Scored> look_up_all(const SceneDepth& scene, const Part& part, const std::vector<Pose>& poses,
                                bool settle) {
  // Half a step of the enumeration at the part's rim: 15 deg / 2 at 0.3 diameters is 3.9 %, its mean over the
  // points 3.5 %.
  const double tolerance = std::max(0.035 * part.diameter_mm, noise_tolerance(scene));
  constexpr std::size_t kAll = 64;
  // A right pose is seen through at few points: at one in six, five of the first eight are once in 200.
  constexpr std::array<GiveUp, 2> kHopeless = {{{8, -1.2}, {24, -0.1}}};
  std::vector<Scored> out(poses.size());
  parallel_ranges(static_cast<int>(poses.size()), 512, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const PartView& view = view_of(part, poses[k]);
      Pose pose = poses[k];
      if (settle) {
        PointRefineOptions o;
        o.iterations = 3;
        o.start_tolerance_mm = 0.12 * part.diameter_mm;
        o.end_tolerance_mm = 0.06 * part.diameter_mm;
        o.center = part.box_center();
        o.lever_mm = part.gyration_mm;
        pose = refine_points(scene, pose, view.points, view.normals, 48, o);
      }
      out[k] = {pose, look_up(scene, pose, view.points, view.normals, kAll, tolerance, kHopeless).score(), k};
    }
  });
  std::erase_if(out, [&](const Scored& s) { return s.score < kKeep; });
  return out;
}

/// Coarse poses moved onto the depth image by a few hundred points, and looked up again with a finer tolerance.
std::vector<Scored> settle(const SceneDepth& scene, const Part& part, std::vector<Scored> coarse) {
  const double fine = std::max(0.012 * part.diameter_mm, noise_tolerance(scene));
  PointRefineOptions options;
  options.center = part.box_center();
  options.lever_mm = part.gyration_mm;
  parallel_ranges(static_cast<int>(coarse.size()), 4, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      Scored& s = coarse[static_cast<std::size_t>(i)];
      PointRefineOptions o = options;
      o.iterations = 5;
      o.start_tolerance_mm = std::max(0.06 * part.diameter_mm, 1.5 * noise_tolerance(scene));
      o.end_tolerance_mm = std::max(0.03 * part.diameter_mm, noise_tolerance(scene));
      const PartView& first = view_of(part, s.pose);
      s.pose = refine_points(scene, s.pose, first.points, first.normals, 192, o);
      o.start_tolerance_mm = o.end_tolerance_mm;
      o.end_tolerance_mm = fine;
      const PartView& second = view_of(part, s.pose);
      s.pose = refine_points(scene, s.pose, second.points, second.normals, 256, o);
      const PartView& third = view_of(part, s.pose);
      s.score = look_up(scene, s.pose, third.points, third.normals, 384, fine).score();
    }
  });
  return coarse;
}

}  // namespace

const PartView& view_of(const Part& part, const Pose& camera_from_part) {
  const Eigen::Vector3d center = camera_from_part * Eigen::Vector3d(part.box_center());
  const Eigen::Vector3d direction = -(camera_from_part.linear().transpose() * center).normalized();
  return nearest_view(part, Vec3(direction));
}

bool close_poses(const Part& part, const Pose& a, const Pose& b, double distance_mm, double angle) {
  return same_placing(part, part.symmetry, a, b, distance_mm, angle);
}

double covered_pixels(const Part& part, const SceneDepth& scene, const Pose& camera_from_part) {
  const PartView& view = view_of(part, camera_from_part);
  const double z = std::max(1.0, (camera_from_part * Eigen::Vector3d(part.box_center())).z());
  return view.area_mm2 * scene.camera.fx * scene.camera.fy / (z * z);
}

int step_for(const Part& part, const SceneDepth& scene, const Pose& camera_from_part, double pixels) {
  return std::max(1, static_cast<int>(std::lround(std::sqrt(covered_pixels(part, scene, camera_from_part) / pixels))));
}

VerificationOptions verification_options(const Part& part, Detail detail, int step_px, double tolerance_mm) {
  VerificationOptions o;
  o.step_px = step_px;
  o.tolerance_mm = tolerance_mm;
  o.cad_sigma_mm = cad_sigma_mm(part, detail);
  o.diameter_mm = part.diameter_mm;
  return o;
}

RefineOptions refine_options(const Part& part, Detail detail, int step_px, int iterations, double start_scale_mm) {
  RefineOptions o;
  o.iterations = iterations;
  o.step_px = step_px;
  o.start_scale_mm = start_scale_mm;
  o.center = part.box_center();
  o.lever_mm = part.gyration_mm;
  o.cad_sigma_mm = cad_sigma_mm(part, detail);
  o.weak_mm = weak_limit_mm(part);
  return o;
}

Refinement refine_guarded(const Part& part, Detail detail, const SceneDepth& scene, const Pose& start,
                          const RefineOptions& options) {
  Refinement refined = refine_pose(mesh_of(part, detail), scene, start, options);
  // What moves no pixel's facet by its noise changes no score.
  if (close_poses(part, start, refined.camera_from_part, 0.3 * scene.median_sigma_mm,
                  0.3 * scene.median_sigma_mm / part.gyration_mm))
    return refined;
  // A few nats are what the raster makes of two poses that are both right.
  constexpr double kRaster = 3;
  const std::array<Pose, 2> poses = {start, refined.camera_from_part};
  const std::vector<double> score = render_scores(scene, part, detail, poses, options.step_px);
  if (score[1] > score[0] - kRaster) return refined;
  RefineOptions stay = options;
  stay.iterations = 0;
  return refine_pose(mesh_of(part, detail), scene, start, stay);
}

namespace {

/// At each place, what explains less than a third of what the best pose there explains, by their looks. Of 309 answers
/// in 24 simulated heaps two came from such poses; a third of all poses are such.
void erase_far_behind(const SceneDepth& scene, const Part& part, std::vector<Scored>& poses) {
  constexpr double kBehind = 0.3;
  const double place = 0.25 * part.diameter_mm;
  std::vector<Vec3> center(poses.size());
  std::vector<double> explained(poses.size());
  std::vector<bool> behind(poses.size(), false);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    center[i] = poses[i].pose * part.box_center();
    explained[i] = poses[i].score * covered_pixels(part, scene, poses[i].pose);
  }
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (std::size_t k = 0; k < poses.size() && !behind[i]; ++k)
      behind[i] = explained[i] < kBehind * explained[k] && (center[i] - center[k]).squaredNorm() < place * place;
  std::size_t n = 0;
  std::erase_if(poses, [&](const Scored&) { return behind[n++]; });
}

/// Least gain of a pose as it is, over the pixels that the part covers: a part that shows 40 % of itself has 0.2 and
/// more.
constexpr double kHardlySeen = 0.05;

/// Poses that one render already leaves without support.
void erase_hardly_seen(const SceneDepth& scene, const Part& part, std::vector<Scored>& poses) {
  std::vector<std::uint8_t> hardly(poses.size());
  parallel_each(static_cast<int>(poses.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const int step = step_for(part, scene, poses[k].pose, 1000);
    const Verification v = verify_pose(part.coarse_mesh, scene, poses[k].pose,
                                       verification_options(part, Detail::coarse, step, 0.012 * part.diameter_mm));
    hardly[k] = v.gain < kHardlySeen * covered_pixels(part, scene, poses[k].pose);
  });
  std::size_t n = 0;
  std::erase_if(poses, [&](const Scored&) { return hardly[n++] != 0; });
}

/// Hypotheses -> look-up -> settled -> rendered, each time fewer.
/// \param settle_first  as `settle` of look_up_all.
std::vector<PoseCandidate> sift(const SceneDepth& scene, const Part& part, int part_index,
                                const std::vector<Pose>& poses, bool settle_first, std::vector<Reason>& rejected) {
  // At one place. Without a primitive's word for it the right pose stands further down the list.
  const int settled_here = settle_first ? 48 : 16, rendered_here = settle_first ? 12 : 4;
  std::vector<Scored> coarse = look_up_all(scene, part, poses, settle_first);
  if (poses.size() > coarse.size())
    add_reason(rejected, {part.name, "hypothesis", "look_up", coarse.empty() ? 0.0 : kKeep, kKeep,
                          static_cast<int>(poses.size() - coarse.size())});
  coarse = best_apart(part, std::move(coarse), settled_here, 0.05 * part.diameter_mm, 14 * kDegree);
  std::vector<Scored> settled = settle(scene, part, std::move(coarse));
  settled = best_apart(part, std::move(settled), rendered_here, 0.02 * part.diameter_mm, 6 * kDegree);
  erase_far_behind(scene, part, settled);
  const std::size_t looked_at = settled.size();
  erase_hardly_seen(scene, part, settled);
  if (looked_at > settled.size())
    add_reason(rejected,
               {part.name, "hypothesis", "hardly_seen", 0, kHardlySeen, static_cast<int>(looked_at - settled.size())});
  std::vector<PoseCandidate> out(settled.size());
  parallel_each(static_cast<int>(settled.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    PoseCandidate& c = out[k];
    c.part = part_index;
    const int step = step_for(part, scene, settled[k].pose, 1000);
    const double start = std::max(0.012 * part.diameter_mm, noise_tolerance(scene));
    RefineOptions options = refine_options(part, Detail::coarse, step, 4, start);
    options.outlines = true;  // a flat part slides on its face without them
    c.camera_from_part = refine_pose(part.coarse_mesh, scene, settled[k].pose, options).camera_from_part;
    c.verification = verify_pose(part.coarse_mesh, scene, c.camera_from_part,
                                 verification_options(part, Detail::coarse, step, 0.004 * part.diameter_mm));
  });
  std::stable_sort(out.begin(), out.end(), [](const PoseCandidate& a, const PoseCandidate& b) {
    return a.verification.gain > b.verification.gain;
  });
  // Several starts that ended in one pose are one candidate.
  std::vector<PoseCandidate> distinct;
  for (const PoseCandidate& c : out)
    if (std::none_of(distinct.begin(), distinct.end(), [&](const PoseCandidate& d) {
          return close_poses(part, c.camera_from_part, d.camera_from_part, 0.015 * part.diameter_mm, 3 * kDegree);
        }))
      distinct.push_back(c);
  return distinct;
}

}  // namespace

std::vector<PoseCandidate> find_candidates(const SceneFeatures& features, SceneDepth& scene, const Part& part,
                                           int part_index, Source source, PartSearch& search,
                                           std::vector<Reason>& rejected) {
  scene.background = background_cells(features, part);
  std::vector<Pose> poses;
  if (source == Source::primitives) {
    const SceneFeatures own = foreground(features, scene.background);
    hypotheses_from_pairs(own, part, poses);
    hypotheses_from_cylinders(own, part, poses);
    hypotheses_from_planes(own, part, poses);
  } else {
    if (!search.pairs) search.pairs.emplace(part.sample_points, part.sample_normals, part.diameter_mm);
    hypotheses_from_point_pairs(features, scene.background, part, *search.pairs, poses);
  }
  // What lies within half a diameter of a pose's middle is looked at, and a quarter around it others compete for
  // places.
  if (features.fresh)
    std::erase_if(poses, [&](const Pose& pose) {
      return !features.changed_near((pose * part.box_center()).cast<float>(), part.diameter_mm);
    });
  return sift(scene, part, part_index, poses, source == Source::point_pairs, rejected);
}

}  // namespace tribin
