#include "rivals.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "render_scores.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/pose/index_render.hpp"
#include "tribin/pose/look_up.hpp"

namespace tribin {
namespace {

/// The primitives that at least a quarter of what is seen belongs to.
std::vector<const Primitive*> mostly_seen(const SceneDepth& scene, const Part& part, const Pose& pose) {
  IndexRender render;
  const int step = step_for(part, scene, pose, kCompareFew);
  render_index(part.render_mesh, scene.camera, pose, step, render);
  std::vector<int> pixels(part.model.primitives.size() + 1, 0);
  int all = 0;
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::size_t k = render.index(i, j);
      if (render.triangle[k] < 0) continue;
      const int u = render.u0 + i * step, v = render.v0 + j * step;
      const float z = scene.z_mm(u, v);
      if (!(std::abs(z - 1 / render.inverse_z[k]) < 0.02 * part.diameter_mm + 5 * scene.sigma_mm(u, v))) continue;
      ++pixels[static_cast<std::size_t>(part.primitive_of_triangle[static_cast<std::size_t>(render.triangle[k])])];
      ++all;
    }
  std::vector<const Primitive*> out;
  for (const Primitive& p : part.model.primitives)
    if (all > 0 && 4 * pixels[static_cast<std::size_t>(p.id)] >= all) out.push_back(&p);
  return out;
}

/// Half turns about the faces that most of what is seen belongs to: about the middle of a plane, end for end of a
/// cylinder. They bring a face onto itself, or nearly, and what would tell may be hidden.
void add_half_turns(std::span<const Primitive* const> seen, const Pose& pose, std::vector<Pose>& out) {
  for (const Primitive* face : seen) {
    const Primitive& p = *face;
    ContinuousSymmetry line;
    line.axis = p.axis;
    line.point = p.point;
    if (p.type == PrimitiveType::cylinder) {
      line.point = p.point + p.axis * (0.5 * (p.extent_min + p.extent_max));
      const Eigen::Vector3d eye = pose.inverse() * Eigen::Vector3d(0, 0, 0) - Eigen::Vector3d(line.point);
      line.axis = Vec3(eye - Eigen::Vector3d(p.axis) * eye.dot(Eigen::Vector3d(p.axis)));
    } else if (p.type != PrimitiveType::plane) {
      continue;
    }
    out.push_back(turned(pose, line, kPi));
  }
}

/// A part that is nearly round, turned over so that one of its faces across the axis takes the place of another: of a
/// wheel that shows one face, the hub may be on either side.
void add_turned_over(const Part& part, const ContinuousSymmetry& axis, const Pose& pose, std::vector<Pose>& out) {
  const Vec3 along = axis.axis.normalized();
  constexpr std::size_t kFaces = 12;  // best exposed
  const std::vector<PartFeature> faces = visible_features(part, PrimitiveType::plane, kFaces);
  std::vector<double> middles;  // along the axis
  for (const PartFeature& up : faces)
    for (const PartFeature& down : faces) {
      const double across = std::cos(4 * kDegree);
      if (up.primitive->axis.dot(along) < across || down.primitive->axis.dot(along) > -across) continue;
      const double middle = 0.5 * along.dot(up.primitive->point + down.primitive->point - 2 * axis.point);
      if (std::any_of(middles.begin(), middles.end(),
                      [&](double other) { return std::abs(other - middle) < 0.01 * part.diameter_mm; }))
        continue;
      middles.push_back(middle);
      Vec3 u, v;
      orthonormal_basis(along, u, v);
      out.push_back(turned(pose, {u, axis.point + middle * along}, kPi));
    }
}

}  // namespace

Pose turned(const Pose& pose, const ContinuousSymmetry& line, double angle) {
  Pose turn = Pose::Identity();
  turn.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d(line.axis).normalized()).toRotationMatrix();
  turn.translation() = Eigen::Vector3d(line.point) - turn.linear() * Eigen::Vector3d(line.point);
  return pose * turn;
}

double angle_about(const ContinuousSymmetry& line, const Pose& motion) {
  const Vec3 axis = line.axis.normalized();
  Vec3 u, v;
  orthonormal_basis(axis, u, v);
  const Vec3 to = motion.linear() * Eigen::Vector3d(u);
  return std::atan2(axis.dot(u.cross(to)), u.dot(to));
}

Pose settled_on_few(const SceneDepth& scene, const Part& part, const Pose& pose, int step_px) {
  RefineOptions options =
      refine_options(part, Detail::coarse, step_px, 3, std::max(0.012 * part.diameter_mm, 4 * scene.median_sigma_mm));
  options.outlines = true;
  return refine_guarded(part, Detail::coarse, scene, pose, options).camera_from_part;
}

std::vector<Pose> rivals(const SceneDepth& scene, const Part& part, const Pose& pose) {
  std::vector<Pose> out;
  // By how much it explains, not by what share of itself: of a rival much more may be hidden.
  const auto explained = [&](const Pose& p, double tolerance) {
    const PartView& view = view_of(part, p);
    return covered_pixels(part, scene, p) *
           look_up(scene, p, view.points, view.normals, 256, std::max(tolerance, 4 * scene.median_sigma_mm)).score();
  };
  // A rival that a few looks already put far behind is none.
  constexpr double kBehind = 0.3;
  const double near = 0.02 * part.diameter_mm,
               enough = explained(pose, near) - kBehind * covered_pixels(part, scene, pose);
  for (const SelfSimilarPose& s : part.self_similar)
    if (const Pose other = pose * s.part_from_part; explained(other, near) > enough) out.push_back(other);
  // Half turns bring a face onto itself but nearly.
  const std::vector<const Primitive*> seen = mostly_seen(scene, part, pose);
  std::vector<Pose> halves;
  add_half_turns(seen, pose, halves);
  const double roughly = 0.05 * part.diameter_mm;
  for (const Pose& other : halves)
    if (explained(other, roughly) > enough) out.push_back(other);
  if (part.nearly_round.empty()) {
    std::vector<Pose> faces;
    add_face_for_face(part, seen, pose, faces);
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < faces.size(); ++i)
      if (const double e = explained(faces[i], roughly); e > enough) order.emplace_back(-e, i);
    std::sort(order.begin(), order.end());
    constexpr std::size_t kLikely = 8;
    std::vector<Pose> distinct = {pose};  // equal faces, and a face that is its own, make one pose many times
    for (std::size_t i = 0; i < order.size() && distinct.size() <= kLikely; ++i) {
      const Pose& other = faces[order[i].second];
      if (std::none_of(distinct.begin(), distinct.end(),
                       [&](const Pose& d) { return close_poses(part, d, other, near, 4 * kDegree); }))
        distinct.push_back(other);
    }
    out.insert(out.end(), distinct.begin() + 1, distinct.end());
  }
  if (part.nearly_round.size() != 1) return out;
  std::vector<Pose> over;
  add_turned_over(part, part.nearly_round[0], pose, over);
  for (const Pose& other : over)
    if (explained(other, roughly) > enough) out.push_back(other);
  // Turned over, a nearly round part has a spin of its own, that no motion of the part tells: the likeliest two stand
  // for all of that side. A tooth beside a tooth of the scan, it would look worse than it is.
  const SymmetryGroup round = {{}, part.nearly_round};
  std::vector<Pose> sides = {pose}, settled;
  for (const Pose& other : out) {
    if (std::any_of(sides.begin(), sides.end(),
                    [&](const Pose& side) { return same_placing(part, round, side, other, near, 4 * kDegree); }))
      continue;
    sides.push_back(other);
    // The spin search wants a place that is right to the noise.
    const Pose side = settled_on_few(scene, part, other, step_for(part, scene, other, kCompareFew));
    constexpr std::size_t kLikeliest = 2;
    for (const Pose& spin : spins(scene, part, side, kLikeliest)) settled.push_back(spin);
  }
  return settled;
}

void add_weakest_moves(const Part& part, const PoseCandidate& from, std::vector<Pose>& out) {
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  const Vec6 scale = scale_of_motion(part.gyration_mm);
  const Eigen::Matrix<double, 6, 6> h =
      scale.asDiagonal() * Eigen::Matrix<double, 6, 6>(from.information) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(h);
  // A direction held a quarter as well as the best one has no such minima.
  if (eigen.eigenvalues()(0) > eigen.eigenvalues()(5) / 16) return;
  const Vec3 center = place_of(part, from);
  // The enumeration's steps leave a pose up to half a step (4 % of the diameter at the rim) from the truth.
  for (const double share : {-0.04, -0.02, 0.02, 0.04}) {
    const Vec6 delta = scale.cwiseProduct(eigen.eigenvectors().col(0)) * (share * part.diameter_mm);
    out.push_back(moved_about(from.camera_from_part, center, Vector6(delta)));
  }
}

}  // namespace tribin
