#include <algorithm>
#include <cmath>

#include "hypotheses.hpp"

namespace tribin {
namespace {

constexpr int kSpins = 24;

struct Region {
  Vec3 centroid = Vec3::Zero();  ///< of its cells, each counted once: as the camera sees them
  double reach_mm = 0;
  int cells = 0;
};

/// Connected pieces of the cell grid that no background primitive explains.
std::vector<Region> regions(const SceneFeatures& scene, const Part& part) {
  const Surfels& surfels = *scene.surfels;
  std::vector<bool> background(scene.features.size() + 1, false);
  for (const SceneFeature& f : scene.features)
    if (is_background(f, part)) background[static_cast<std::size_t>(f.primitive->id)] = true;

  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  Image<std::uint8_t> taken(grid.width, grid.height, 0);
  std::vector<Region> out;
  std::vector<std::pair<int, int>> stack;
  std::vector<std::int32_t> members;
  const auto foreground = [&](int i, int j) {
    const std::int32_t s = grid(i, j);
    return s >= 0 && !background[static_cast<std::size_t>(scene.primitives->label_of_surfel[static_cast<std::size_t>(s)])];
  };
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      if (taken(i, j) || !foreground(i, j)) continue;
      members.clear();
      stack.assign(1, {i, j});
      taken(i, j) = 1;
      while (!stack.empty()) {
        const auto [x, y] = stack.back();
        stack.pop_back();
        members.push_back(grid(x, y));
        // Two cells far: across the cells that an edge spoils.
        for (int dy = -2; dy <= 2; ++dy)
          for (int dx = -2; dx <= 2; ++dx) {
            const int xx = x + dx, yy = y + dy;
            if (!grid.contains(xx, yy) || taken(xx, yy) || !foreground(xx, yy)) continue;
            taken(xx, yy) = 1;
            stack.emplace_back(xx, yy);
          }
      }
      Region r;
      r.cells = static_cast<int>(members.size());
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const std::int32_t s : members) sum += surfels.position[static_cast<std::size_t>(s)].cast<double>();
      r.centroid = sum / r.cells;
      for (const std::int32_t s : members)
        r.reach_mm = std::max(r.reach_mm, (surfels.position[static_cast<std::size_t>(s)].cast<double>() - r.centroid).norm());
      out.push_back(r);
    }
  return out;
}

}  // namespace

void hypotheses_from_regions(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out) {
  double view_area = 0;
  for (const PartView& v : part.views) view_area = std::max(view_area, v.area_mm2);
  const PinholeCamera& camera = scene.surfels->scan->camera;
  for (const Region& region : regions(scene, part)) {
    if (region.reach_mm > 0.9 * part.diameter_mm || region.reach_mm < 0.15 * part.diameter_mm) continue;
    const Eigen::Vector3d toward = -Eigen::Vector3d(region.centroid).normalized();  // to the camera
    const double pitch = region.centroid.z() / camera.fx * scene.surfels->cell_px;
    const double seen_area = region.cells * pitch * pitch;
    Vec3 su, sv;
    orthonormal_basis(Vec3(toward), su, sv);
    for (const PartView& view : part.views) {
      // A region holds what is seen of the view, less its drop-outs and edges, plus what touches it.
      if (view.points.empty() || seen_area > 1.6 * view.area_mm2 || seen_area < 0.25 * view.area_mm2) continue;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const Vec3f& p : view.points) mean += p.cast<double>();
      mean /= static_cast<double>(view.points.size());
      Vec3 pu, pv;
      orthonormal_basis(view.direction, pu, pv);
      for (int k = 0; k < kSpins; ++k) {
        const double a = 2 * kPi * k / kSpins;
        const Matrix3 r = rotation_from_directions(view.direction, pu, Vec3(toward), su * std::cos(a) + sv * std::sin(a));
        out.push_back(pose_from(r, Vec3(mean), region.centroid));
      }
    }
  }
}

}  // namespace tribin
