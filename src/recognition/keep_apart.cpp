#include "keep_apart.hpp"

#include <algorithm>
#include <array>
#include <memory>

#include "candidates.hpp"
#include "contacts.hpp"
#include "render_scores.hpp"
#include "tolerances.hpp"

namespace tribin {
namespace {

const Part& part_of(std::span<const Part> parts, const Instance& instance) {
  return *std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == instance.part; });
}

/// Solids of the parts that are there, in the order of the parts; null for those that are not, or have no inside.
std::vector<std::unique_ptr<Solid>> solids_of(std::span<const Part> parts, const std::vector<Instance>& items) {
  std::vector<std::unique_ptr<Solid>> out(parts.size());
  for (const Instance& instance : items) {
    const Part& part = part_of(parts, instance);
    auto& solid = out[static_cast<std::size_t>(&part - parts.data())];
    if (!solid && !part.render_mesh.two_sided)
      solid = std::make_unique<Solid>(part.coarse_mesh.vertices, part.coarse_mesh.triangles);
  }
  return out;
}

Body body_of(const Part& part, const Solid& solid, const Pose& pose, const Matrix6& covariance) {
  Body body;
  body.solid = &solid;
  body.points = part.sample_points;
  body.normals = part.sample_normals;
  body.camera_from_body = pose;
  body.covariance = covariance;
  body.tolerance_mm = form_tolerance_mm(part.diameter_mm) + part.mesh.chord_error_mm + part.coarse_error_mm;
  return body;
}

Body body_of(const BinSighting& bin, const Solid& solid) {
  Body body;
  body.solid = &solid;
  body.camera_from_body = bin.camera_from_bin;
  body.covariance = bin.covariance;
  body.fixed = true;
  body.tolerance_mm = bin.tolerance_mm;
  return body;
}

Solid solid_of(const BinSighting& bin) {
  const Mesh mesh = bin_mesh(bin.shape);
  return {mesh.vertices, mesh.triangles};
}

/// The covariance of a pose (dt of its origin, w) as that of another pose of the same body.
Matrix6 covariance_at(const Vec3& origin, const Instance& instance) {
  const Vec3 arm = origin - instance.camera_from_part.translation();
  Eigen::Matrix<double, 6, 6> m = Eigen::Matrix<double, 6, 6>::Identity();
  m.topRightCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  return Matrix6(m * Eigen::Matrix<double, 6, 6>(instance.covariance) * m.transpose());
}

/// The move is taken back where the scan is less likely by more than the raster makes of two poses that are both right.
bool is_worse(const Part& part, const SceneDepth& scene, const Pose& old_pose, const Pose& new_pose) {
  constexpr double kRaster = 3, kPixels = 10000;
  const std::array<Pose, 2> poses = {old_pose, new_pose};
  const std::vector<double> score =
      render_scores(scene, part, Detail::full, poses, step_for(part, scene, old_pose, kPixels));
  return score[1] < score[0] - kRaster;
}

}  // namespace

void strike_out_in_bin(const Part& part, const BinSighting& bin, Instance& instance) {
  if (instance.alternatives.empty() || part.render_mesh.two_sided) return;
  const Solid solid(part.coarse_mesh.vertices, part.coarse_mesh.triangles), bin_solid = solid_of(bin);
  const auto is_in_bin = [&](const Pose& pose) {
    const std::array<Body, 2> bodies = {body_of(part, solid, pose, covariance_at(pose.translation(), instance)),
                                        body_of(bin, bin_solid)};
    const std::vector<Overlap> found = overlaps(bodies);
    return !found.empty() && found.front().depth_mm > std::max(found.front().limit_mm, weak_limit_mm(part));
  };
  std::vector<Alternative> all = {{instance.camera_from_part, 1, ""}};
  for (const Alternative& a : instance.alternatives) {
    all.front().probability -= a.probability;
    all.push_back(a);
  }
  std::vector<Alternative> clear;
  double sum = 0;
  for (const Alternative& a : all) {
    if (is_in_bin(a.camera_from_part)) continue;
    clear.push_back(a);
    sum += a.probability;
  }
  // All in the bin: what is said of one is said of all, and the pose itself is looked at later (keep_apart).
  if (clear.empty() || clear.size() == all.size()) return;
  for (Alternative& a : clear) a.probability /= sum;
  const auto best = std::max_element(clear.begin(), clear.end(), [](const Alternative& a, const Alternative& b) {
    return a.probability < b.probability;
  });
  std::rotate(clear.begin(), best, best + 1);
  const Pose now = clear.front().camera_from_part;
  instance.covariance = covariance_at(now.translation(), instance);
  instance.camera_from_part = now;
  for (std::size_t s = 0; s < instance.equivalent_poses.size(); ++s)
    instance.equivalent_poses[s] = now * part.symmetry.discrete[s + 1];
  instance.alternatives.assign(clear.begin() + 1, clear.end());
  for (Alternative& a : instance.alternatives)
    if (a.decided_by.empty()) a.decided_by = "the surface where the two poses differ";
}

void keep_apart(std::span<const Part> parts, const SceneDepth& scene, const BinSighting* bin,
                std::vector<Instance>& items, std::vector<Reason>& rejected) {
  const bool in_bin = bin != nullptr && bin->found;
  const std::vector<std::unique_ptr<Solid>> solids = solids_of(parts, items);
  std::vector<Body> bodies;
  std::vector<std::size_t> item_of;  // of each body; items.size() = the bin
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Part& part = part_of(parts, items[i]);
    const Solid* solid = solids[static_cast<std::size_t>(&part - parts.data())].get();
    if (solid == nullptr) continue;
    bodies.push_back(body_of(part, *solid, items[i].camera_from_part, items[i].covariance));
    item_of.push_back(i);
  }
  std::unique_ptr<Solid> bin_solid;
  if (in_bin) {
    bin_solid = std::make_unique<Solid>(solid_of(*bin));
    bodies.push_back(body_of(*bin, *bin_solid));
    item_of.push_back(items.size());
  }
  const std::vector<Overlap> overlap = overlaps(bodies);
  if (overlap.empty()) return;
  separate(bodies, overlap);
  // All that moved, or none: one that goes back alone may stand in another again.
  bool worse = false;
  const auto moved = [&](std::size_t k) {
    return item_of[k] < items.size() &&
           bodies[k].camera_from_body.matrix() != items[item_of[k]].camera_from_part.matrix();
  };
  for (std::size_t k = 0; k < bodies.size() && !worse; ++k)
    worse = moved(k) && is_worse(part_of(parts, items[item_of[k]]), scene, items[item_of[k]].camera_from_part,
                                 bodies[k].camera_from_body);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    if (!moved(k)) continue;
    Instance& instance = items[item_of[k]];
    if (worse) {
      bodies[k].camera_from_body = instance.camera_from_part;
      continue;
    }
    instance.camera_from_part = bodies[k].camera_from_body;
    const Part& part = part_of(parts, instance);
    for (std::size_t s = 0; s < instance.equivalent_poses.size(); ++s)
      instance.equivalent_poses[s] = instance.camera_from_part * part.symmetry.discrete[s + 1];
  }
  // What is still in each other: one of the two is wrong. Below what a pose may be off along a weak direction unseen it
  // may be either's tilt.
  std::vector<char> out(items.size() + 1, 0);
  for (const Overlap& o : overlaps(bodies)) {
    const std::size_t a = item_of[o.a], b = item_of[o.b];
    if (out[a] || out[b]) continue;
    const std::size_t less_sure = b == items.size() || items[a].score < items[b].score ? a : b;
    const Part& part = part_of(parts, items[less_sure]);
    const double limit = std::max(o.limit_mm, weak_limit_mm(part));
    if (o.depth_mm <= limit) continue;
    out[less_sure] = 1;
    add_reason(rejected, {part.name, "acceptance", "penetration", o.depth_mm, limit, 1,
                          Vec3(items[less_sure].camera_from_part * part.box_center())});
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (!out[i]) {
      if (kept != i) items[kept] = std::move(items[i]);
      ++kept;
    }
  items.resize(kept);
}

}  // namespace tribin
