#include "rivals.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
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

/// A plane face and the rectangle around it along the axes of its second moments.
struct Rectangle {
  Eigen::Matrix3d axes;    ///< columns: long side, short side, outward normal
  Eigen::Vector3d corner;  ///< where both sides are least
  std::array<double, 2> sides{};
};

Rectangle rectangle_of(const Part& part, const Primitive& face) {
  std::vector<Eigen::Vector3d> corners;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  double area = 0;
  for (std::size_t t = 0; t < part.mesh.triangles.size(); ++t) {
    if (part.primitive_of_triangle[t] != face.id) continue;
    std::array<Eigen::Vector3d, 3> v;
    for (std::size_t k = 0; k < 3; ++k) v[k] = part.mesh.vertices[part.mesh.triangles[t][k]].cast<double>();
    corners.insert(corners.end(), v.begin(), v.end());
    const double a = 0.5 * (v[1] - v[0]).cross(v[2] - v[0]).norm();
    const Eigen::Vector3d total = v[0] + v[1] + v[2];
    area += a;
    sum += a / 3 * total;
    moment += a / 12 * (total * total.transpose());
    for (const Eigen::Vector3d& p : v) moment += a / 12 * (p * p.transpose());
  }
  Rectangle out;
  const Eigen::Vector3d n = face.axis, middle = sum / area;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moment / area - middle * middle.transpose());
  const Eigen::Vector3d u = (eigen.eigenvectors().col(2) - n * n.dot(eigen.eigenvectors().col(2))).normalized();
  out.axes << u, n.cross(u), n;
  Eigen::Vector3d least = Eigen::Vector3d::Constant(1e30), most = -least;
  for (const Eigen::Vector3d& p : corners) {
    least = least.cwiseMin(out.axes.transpose() * p);
    most = most.cwiseMax(out.axes.transpose() * p);
  }
  out.corner = out.axes * least;
  out.sides = {most.x() - least.x(), most.y() - least.y()};
  return out;
}

/// Another of the part's faces, or the same one turned, in the place of one that is seen: flush with each of its
/// corners, in quarter turns. Of a prism of which one face is seen, the scan may tell which one it is by its outline
/// only, and a search that has begun with a wrong one does not leave it.
void add_face_for_face(const Part& part, std::span<const Primitive* const> seen, const Pose& pose,
                       std::vector<Pose>& out) {
  constexpr std::size_t kFaces = 8;  // best exposed
  std::vector<Rectangle> others;
  for (const PartFeature& f : visible_features(part, PrimitiveType::plane, kFaces))
    others.push_back(rectangle_of(part, *f.primitive));
  for (const Primitive* face : seen) {
    if (face->type != PrimitiveType::plane) continue;
    const Rectangle own = rectangle_of(part, *face);
    for (const Rectangle& other : others)
      for (int quarter = 0; quarter < 4; ++quarter) {
        // Sides of the other face that come to lie along the first and second side of this one, with their senses.
        const bool swapped = quarter % 2 == 1;
        Eigen::Matrix3d axes = other.axes * Eigen::AngleAxisd(0.5 * kPi * quarter, Eigen::Vector3d::UnitZ()).matrix();
        const std::array<double, 2> sides = {other.sides[swapped], other.sides[!swapped]};
        // Where both sides are least in the turned axes.
        Eigen::Vector3d corner = other.corner;
        const Eigen::Vector3d far =
            other.corner + other.axes.col(0) * other.sides[0] + other.axes.col(1) * other.sides[1];
        for (int k = 0; k < 2; ++k) corner += axes.col(k) * std::min(0.0, axes.col(k).dot(far - other.corner));
        Pose part_from_part;
        part_from_part.linear() = own.axes * axes.transpose();
        for (int end = 0; end < 4; ++end) {
          Eigen::Vector3d to = own.corner;
          bool twice = false;
          for (int k = 0; k < 2; ++k) {
            const double room = own.sides[static_cast<std::size_t>(k)] - sides[static_cast<std::size_t>(k)];
            if (!(end >> k & 1)) continue;
            twice = twice || std::abs(room) < 0.01 * part.diameter_mm;
            to += own.axes.col(k) * room;
          }
          if (twice) continue;
          part_from_part.translation() = to - part_from_part.linear() * corner;
          out.push_back(pose * part_from_part);
        }
      }
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

/// Where a function on a circle is largest around. Where it is level, because what would tell is hidden, one of
/// `every` stands for its neighbours.
std::vector<int> maxima_around(std::span<const double> score, int every) {
  const auto n = static_cast<int>(score.size());
  const auto at = [&](int i) { return score[static_cast<std::size_t>((i % n + n) % n)]; };
  std::vector<int> out;
  for (int k = 0; k < n; ++k) {
    if (at(k) <= at(k - 1)) continue;
    int end = k + 1;
    while (at(end) == at(k)) ++end;
    if (at(end) > at(k)) continue;
    for (int i = k; i < end; i += every) out.push_back(i % n);
  }
  if (std::all_of(score.begin(), score.end(), [&](double s) { return s == score[0]; }))
    for (int k = 0; k < n; k += every) out.push_back(k);
  return out;
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

// A search on the likelihood, because ICP slides past the small features that decide. (The view's points instead of
// renders rank the right spin behind the eighth in 15 % of the cases, renders in 2 %.)
std::vector<Pose> spins(const SceneDepth& scene, const Part& part, const Pose& pose, std::size_t most) {
  std::vector<Pose> out;
  constexpr int kSpins = 120;  // 3 deg: a hole of 5 % of the diameter at its rim
  constexpr std::size_t kBest = 8;
  constexpr std::size_t kLooked = 24;  // maxima on few pixels that are looked at again on more
  const int few = step_for(part, scene, pose, kCompareFew), step = step_for(part, scene, pose, kPolishPixels);
  for (const ContinuousSymmetry& axis : part.nearly_round) {
    std::vector<Pose> turns;
    for (int k = 0; k < kSpins; ++k) turns.push_back(turned(pose, axis, 2 * kPi * k / kSpins));
    std::vector<double> score = render_scores(scene, part, Detail::coarse, turns, few);
    std::vector<int> maxima = maxima_around(score, kSpins / static_cast<int>(kLooked));
    std::erase(maxima, 0);  // the pose itself
    const auto best_first = [&] {
      std::stable_sort(maxima.begin(), maxima.end(), [&](int a, int b) {
        return score[static_cast<std::size_t>(a)] > score[static_cast<std::size_t>(b)];
      });
    };
    best_first();
    if (maxima.size() > kLooked) maxima.resize(kLooked);
    if (step < few) {
      std::vector<Pose> looked;
      for (const int k : maxima) looked.push_back(turns[static_cast<std::size_t>(k)]);
      const std::vector<double> finer = render_scores(scene, part, Detail::full, looked, step);
      for (std::size_t i = 0; i < maxima.size(); ++i) score[static_cast<std::size_t>(maxima[i])] = finer[i];
      best_first();
    }
    // Where the scan hardly tells the spins apart, all of them are alternatives.
    std::size_t keep = std::min({kBest, most, maxima.size()});
    while (keep < std::min(most, maxima.size()) &&
           score[static_cast<std::size_t>(maxima[keep])] > score[static_cast<std::size_t>(maxima[0])] - kUndecided)
      ++keep;
    // Refinement hardly turns what is nearly round: the spins are brought to their best by halves of the step.
    std::vector<double> angle(keep), best(keep);
    for (std::size_t i = 0; i < keep; ++i) {
      angle[i] = 2 * kPi * maxima[i] / kSpins;
      best[i] = score[static_cast<std::size_t>(maxima[i])];
    }
    constexpr int kHalvings = 3;  // to 0.4 deg
    for (int h = 0; h < kHalvings; ++h) {
      const double turn = kPi / kSpins / (1 << h);
      std::vector<double> tried;
      std::vector<Pose> beside;
      for (std::size_t i = 0; i < 2 * keep; ++i) {
        tried.push_back(angle[i / 2] + (i % 2 ? turn : -turn));
        beside.push_back(turned(pose, axis, tried.back()));
      }
      const std::vector<double> there = render_scores(scene, part, Detail::coarse, beside, std::min(step, few));
      for (std::size_t i = 0; i < 2 * keep; ++i)
        if (there[i] > best[i / 2]) {
          best[i / 2] = there[i];
          angle[i / 2] = tried[i];
        }
    }
    for (std::size_t i = 0; i < keep; ++i) out.push_back(turned(pose, axis, angle[i]));
  }
  return out;
}

std::vector<Pose> rivals(const SceneDepth& scene, const Part& part, const Pose& pose) {
  std::vector<Pose> out;
  const auto score = [&](const Pose& p, double tolerance) {
    const PartView& view = view_of(part, p);
    return look_up(scene, p, view.points, view.normals, 256, std::max(tolerance, 4 * scene.median_sigma_mm)).score();
  };
  // A rival that a few looks already put far behind is none.
  constexpr double kBehind = 0.3;
  const double near = 0.02 * part.diameter_mm, own = score(pose, near);
  for (const SelfSimilarPose& s : part.self_similar)
    if (const Pose other = pose * s.part_from_part; score(other, near) > own - kBehind) out.push_back(other);
  // Half turns bring a face onto itself but nearly.
  const std::vector<const Primitive*> seen = mostly_seen(scene, part, pose);
  std::vector<Pose> halves;
  add_half_turns(seen, pose, halves);
  const double roughly = 0.05 * part.diameter_mm;
  for (const Pose& other : halves)
    if (score(other, roughly) > own - kBehind) out.push_back(other);
  if (part.nearly_round.empty()) {
    std::vector<Pose> faces;
    add_face_for_face(part, seen, pose, faces);
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < faces.size(); ++i)
      if (const double s = score(faces[i], roughly); s > own - kBehind) order.emplace_back(-s, i);
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
    if (score(other, roughly) > own - kBehind) out.push_back(other);
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
    const int few = step_for(part, scene, other, kCompareFew);
    RefineOptions options =
        refine_options(part, Detail::coarse, few, 3, std::max(0.012 * part.diameter_mm, 4 * scene.median_sigma_mm));
    options.outlines = true;
    const Pose side = refine_guarded(part, Detail::coarse, scene, other, options).camera_from_part;
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
