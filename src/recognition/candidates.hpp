#pragma once

#include <vector>

#include "detail.hpp"
#include "hypotheses.hpp"
#include "point_pairs.hpp"
#include "tribin/core/reason.hpp"
#include "tribin/pose/refine.hpp"
#include "tribin/pose/verification.hpp"

namespace tribin {

/// A pose of a part that survived the look-up and was refined and verified by rendering.
struct PoseCandidate {
  int part = 0;  ///< index into the parts
  Pose camera_from_part = Pose::Identity();
  Verification verification;
  Matrix6 information = Matrix6::Zero();  ///< of its last refinement, as of Refinement
};

/// Centre of the part's box, camera frame [mm].
inline Vec3 place_of(const Part& part, const PoseCandidate& candidate) {
  return candidate.camera_from_part * part.box_center();
}

/// The part's view that the camera has of it at a pose.
const PartView& view_of(const Part& part, const Pose& camera_from_part);

/// How many pixels the part covers at most, at the depth of a pose.
double covered_pixels(const Part& part, const SceneDepth& scene, const Pose& camera_from_part);
/// Render step that leaves about `pixels` of the part.
int step_for(const Part& part, const SceneDepth& scene, const Pose& camera_from_part, double pixels);

VerificationOptions verification_options(const Part& part, Detail detail, int step_px, double tolerance_mm);
RefineOptions refine_options(const Part& part, Detail detail, int step_px, int iterations, double start_scale_mm);

/// A direction of the pose that the data holds no better than this [mm at the gyration radius] is weak: 1 % of the
/// diameter, a fifth of what counts as found. Refinement leaves it alone and the answer tells of it.
inline double weak_limit_mm(const Part& part) { return 0.01 * part.diameter_mm; }

/// refine_pose, taken back where the scan is less likely at the refined pose than at its start: normals alone let a
/// part slide along its weak directions, past steps that only its depth shows.
Refinement refine_guarded(const Part& part, Detail detail, const SceneDepth& scene, const Pose& start,
                          const RefineOptions& options);

/// Where hypotheses come from, cheapest and surest first.
enum class Source { primitives, point_pairs };

/// What searches for one part share.
struct PartSearch {
  std::optional<PointPairTable> pairs;  ///< made when first wanted: some 10 ms
};

/// The candidates of one part in what is not explained yet, best evidence first.
/// \param scene  its `background` is set for this part.
std::vector<PoseCandidate> find_candidates(const SceneFeatures& features, SceneDepth& scene, const Part& part,
                                           int part_index, Source source, PartSearch& search,
                                           std::vector<Reason>& rejected);

/// Do two poses of one part mean the same placing, its symmetries aside?
/// \param distance_mm, angle  how far the centre of its box may be off, and how far it may be turned.
bool close_poses(const Part& part, const Pose& a, const Pose& b, double distance_mm, double angle);

}  // namespace tribin
