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

/// The move is taken back where the scan is less likely by more than the raster makes of two poses that are both right.
bool is_worse(const Part& part, const SceneDepth& scene, const Pose& old_pose, const Pose& new_pose) {
  constexpr double kRaster = 3, kPixels = 10000;
  const std::array<Pose, 2> poses = {old_pose, new_pose};
  const std::vector<double> score =
      render_scores(scene, part, Detail::full, poses, step_for(part, scene, old_pose, kPixels));
  return score[1] < score[0] - kRaster;
}

}  // namespace

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
    Body body;
    body.solid = solid;
    body.points = part.sample_points;
    body.normals = part.sample_normals;
    body.camera_from_body = items[i].camera_from_part;
    body.covariance = items[i].covariance;
    body.tolerance_mm = form_tolerance_mm(part.diameter_mm) + part.mesh.chord_error_mm + part.coarse_error_mm;
    bodies.push_back(body);
    item_of.push_back(i);
  }
  std::unique_ptr<Solid> bin_solid;
  if (in_bin) {
    const Mesh mesh = bin_mesh(bin->shape);
    bin_solid = std::make_unique<Solid>(mesh.vertices, mesh.triangles);
    Body body;
    body.solid = bin_solid.get();
    body.camera_from_body = bin->camera_from_bin;
    body.covariance = bin->covariance;
    body.fixed = true;
    body.tolerance_mm = bin->tolerance_mm;
    bodies.push_back(body);
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
