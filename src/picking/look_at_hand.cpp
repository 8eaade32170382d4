// What a scan shows of a part in the hand.
#include <cmath>
#include <limits>

#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/picking/vision.hpp"
#include "tribin/recognition/known_pose.hpp"

namespace tribin::picking {
namespace {

// Pixels within this of the gripper as drawn are taken for it: robot, hand-eye and noise, three times, and what a
// drawing of boxes leaves out.
constexpr double kGripper_mm = 3;
// The part is gone where the camera sees through so much of what can be judged of it; and that is judged on so much of
// its silhouette.
constexpr double kGone = 0.8, kJudged = 0.2;
// A pose this far from the grip's is another one of the part's self-similar poses, or one that no slip leads to: of the
// diameter, and its turn.
constexpr double kElsewhere = 0.05, kElsewhereTurn = 10 * kDegree;
constexpr double kSure = 2.0 / 3;  // as of the parts that are picked

/// Whether a point lies within a gap of a body that is not swept.
bool is_near(const grasp::Convex& body, const Vec3& point, double gap_mm) {
  const Vec3 q = ((body.frame_from_body.inverse() * point).cwiseAbs() - body.half_mm).cwiseMax(0.0);
  return std::hypot(std::max(0.0, std::hypot(q.x(), q.y()) - body.disc_mm), q.z()) <= body.radius_mm + gap_mm;
}

/// The scan without what the gripper shows.
Scan without_gripper(const Scan& scan, const HandView& view, const Pose& camera_from_base) {
  Scan out = scan;
  std::vector<grasp::Convex> pieces;
  Vec3 middle = Vec3::Zero();
  for (const grasp::Convex& piece : grasp::pieces_at(*view.gripper, view.opening_mm)) {
    pieces.push_back(grasp::moved(camera_from_base * view.base_from_tcp, piece));
    middle += pieces.back().frame_from_body.translation();
  }
  if (pieces.empty()) return out;
  middle /= static_cast<double>(pieces.size());
  double reach = 0;  // most points are farther from its middle than any of it
  for (const grasp::Convex& piece : pieces)
    reach = std::max(reach, (piece.frame_from_body.translation() - middle).norm() + piece.half_mm.norm() +
                                piece.disc_mm + piece.radius_mm + kGripper_mm);
  parallel_ranges(out.height(), 64, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < out.width(); ++u) {
        float& z = out.z_mm(u, v);
        if (!(z > 0)) continue;
        const Vec3 point = scan.point(u, v);
        if ((point - middle).squaredNorm() > reach * reach) continue;
        for (const grasp::Convex& piece : pieces)
          if (is_near(piece, point, kGripper_mm)) {
            z = std::numeric_limits<float>::quiet_NaN();
            break;
          }
      }
  });
  return out;
}

std::string text_of(const Reason& reason) {
  char text[160];
  std::snprintf(text, sizeof text, "%s %.2f, wanted %.2f", reason.test.c_str(), reason.value, reason.limit);
  return text;
}

/// Of the poses that the part's symmetries make equal to the measured one, the nearest to the grip's.
Pose nearest_alike(const Part& part, const Pose& measured, const Pose& wanted) {
  Pose best = measured;
  for (const Pose& same : all_symmetries(part).discrete)
    if (const Pose other = measured * same;
        rotation_angle(other.linear(), wanted.linear()) < rotation_angle(best.linear(), wanted.linear()))
      best = other;
  return best;
}

}  // namespace

HandSight look_at_hand(const Scan& scan, const Pose& base_from_camera, const Part& part, const HandView& view) {
  HandSight sight;
  const Pose camera_from_base = base_from_camera.inverse(),
             expected = camera_from_base * view.base_from_tcp * view.tcp_from_part;
  const Scan rest = without_gripper(scan, view, camera_from_base);
  if (!scan.rays.empty() || valid_count(rest) < 100) {
    sight.why = "the scan holds no measurement, or no grid of a camera";
    return sight;
  }
  const Surfels surfels = surfels_from_scan(rest);
  const KnownPose found = measure_known(surfels, part, expected);
  if (found.measured > kJudged && found.seen_through > kGone) {
    sight.state = HandSight::State::gone;
    sight.why = "the camera sees through where it should be";
    return sight;
  }
  if (!found.instance) {
    sight.why = found.rejected.empty() ? "it is not seen" : text_of(found.rejected.back());
    return sight;
  }
  const Instance& instance = *found.instance;
  const SymmetryGroup same = all_symmetries(part);
  sight.look.base_from_tcp = view.base_from_tcp;
  sight.look.base_from_part = base_from_camera * nearest_alike(part, instance.camera_from_part, expected);
  const Matrix3 axes = base_from_camera.linear();
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = axes;
  // The covariance is about the part's origin, which the symmetries leave where it is.
  sight.look.covariance = turn * instance.covariance * turn.transpose();
  for (const Vector6& free : instance.free_directions) sight.look.free_directions.push_back(turn * free);
  const bool here =
      same_placing(part, same, instance.camera_from_part, expected, kElsewhere * part.diameter_mm, kElsewhereTurn);
  if (!instance.weak_directions.empty()) {
    sight.why = "the scan does not hold its pose";
  } else if (here) {
    sight.state = HandSight::State::measured;
  } else if (instance.score >= kSure) {
    sight.state = HandSight::State::otherwise;
    sight.why = "it is held otherwise than it was found";
  } else {
    sight.why = "the scan does not tell how it is turned";
  }
  return sight;
}

}  // namespace tribin::picking
