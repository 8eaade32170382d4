#include "tribin/recognition/known_pose.hpp"

#include "answer.hpp"
#include "tribin/core/error.hpp"

namespace tribin {

KnownPose measure_known(const Surfels& surfels, const Part& part, const Pose& camera_from_part) {
  TRIBIN_ASSERT(surfels.scan != nullptr);
  KnownPose out;
  const SceneDepth scene = make_scene_depth(*surfels.scan, surfels);
  PoseCandidate known;
  known.camera_from_part = camera_from_part;
  // What is a fiftieth of the diameter off is a pose to be refined, not one that is seen through.
  constexpr double kPixels = 4000, kNear = 0.02;
  const int step = step_for(part, scene, camera_from_part, kPixels);
  const Verification there = verify_pose(part.coarse_mesh, scene, camera_from_part,
                                         verification_options(part, Detail::coarse, step, kNear * part.diameter_mm));
  out.measured = there.measured_fraction();
  out.seen_through = there.free_space();
  const PoseCandidate settled = settled_on_scan(scene, part, known);
  if (!plausible(part, settled, out.rejected)) return out;
  const Polished polished = polish(scene, std::span(&part, 1), settled, {});
  if (!acceptable(part, polished.candidate, out.rejected)) return out;
  const LastWord last = last_word(polished, part, scene, surfels.scan->noise);
  Answer answer = make_answer(polished, last, last.field.mm2, part, {});
  if (answer.place < kGivenOut) {
    add_reason(out.rejected, {part.name, "acceptance", "probability", answer.place, kGivenOut, 1,
                              place_of(part, polished.candidate)});
    return out;
  }
  out.instance = std::move(answer.instance);
  return out;
}

}  // namespace tribin
