#include <algorithm>
#include <cmath>

#include "hypotheses.hpp"

namespace tribin {
namespace {

/// A piece of the scan that no background explains, as the camera sees it.
struct Region {
  Vec3 toward = Vec3::UnitZ();  ///< unit, to the camera
  Vec3 u, v;                    ///< across it
  Vec2 along_u, along_v;        ///< 1 % and 99 % quantiles of its cells [mm]
  double depth = 0;             ///< median along -toward
  std::vector<std::int32_t> surfels;
};

double mean_view_area(const Part& part) {
  double sum = 0;
  for (const PartView& v : part.views) sum += v.area_mm2;
  return sum / static_cast<double>(part.views.size());
}

Vec2 quantiles(std::vector<double>& x) {
  const auto cut = static_cast<std::ptrdiff_t>(x.size() / 100);
  std::nth_element(x.begin(), x.begin() + cut, x.end());
  const double low = x[static_cast<std::size_t>(cut)];
  std::nth_element(x.begin(), x.end() - 1 - cut, x.end());
  return {low, *(x.end() - 1 - cut)};
}

/// Ids of the primitives that are too large for the part, as flags.
std::vector<bool> background_flags(const SceneFeatures& scene, const Part& part) {
  std::vector<bool> background(scene.primitives->items.size() + 1, false);
  for (const SceneFeature& f : scene.features)
    if (is_background(f, part)) background[static_cast<std::size_t>(f.primitive->id)] = true;
  return background;
}

/// Local sd of z at a cell [mm].
double local_sigma(const Surfels& surfels, std::size_t cell) {
  const Image<float>& tiles = surfels.local_sigma_mm;
  const int i = static_cast<int>(cell) % surfels.surfel_of_cell.width,
            j = static_cast<int>(cell) / surfels.surfel_of_cell.width;
  return tiles(std::min(i / 8, tiles.width - 1), std::min(j / 8, tiles.height - 1));
}

}  // namespace

Image<std::uint8_t> background_cells(const SceneFeatures& scene, const Part& part) {
  const std::vector<bool> background = background_flags(scene, part);
  const Image<std::int32_t>& grid = scene.surfels->surfel_of_cell;
  Image<std::uint8_t> out(grid.width, grid.height, 0);
  // Noise that hides 6 % of the part's size (4 sigma) lets everything look like it: such places say nothing of this
  // part.
  const double loudest = 0.015 * part.diameter_mm;
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (grid.data[i] >= 0)
      out.data[i] = local_sigma(*scene.surfels, i) > loudest || (!scene.claimed.empty() && scene.claimed.data[i]) ||
                    background[static_cast<std::size_t>(
                        scene.primitives->label_of_surfel[static_cast<std::size_t>(grid.data[i])])];
  return out;
}

namespace {

/// Connected pieces of the cell grid that neither the background nor an accepted instance explains.
std::vector<Region> regions(const SceneFeatures& scene, const Part& part) {
  const Surfels& surfels = *scene.surfels;
  const Image<std::uint8_t> background = background_cells(scene, part);
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  Image<std::uint8_t> taken(grid.width, grid.height, 0);
  std::vector<Region> out;
  std::vector<std::pair<int, int>> stack;
  std::vector<std::int32_t> members;
  const auto foreground = [&](int i, int j) { return grid(i, j) >= 0 && !background(i, j); };
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
      // A crumb: less than a seventh of what the part shows on average is the rim of something explained.
      const double pitch =
          surfels.position[static_cast<std::size_t>(members[0])].z() / surfels.scan->camera.fx * surfels.cell_px;
      if (members.size() < 20 || static_cast<double>(members.size()) * pitch * pitch < mean_view_area(part) / 7)
        continue;
      Region r;
      r.surfels = members;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const std::int32_t s : members) sum += surfels.position[static_cast<std::size_t>(s)].cast<double>();
      r.toward = Vec3(-sum.normalized());
      orthonormal_basis(r.toward, r.u, r.v);
      std::vector<double> x(members.size()), y(members.size()), z(members.size());
      for (std::size_t k = 0; k < members.size(); ++k) {
        const Vec3 p = surfels.position[static_cast<std::size_t>(members[k])].cast<double>();
        x[k] = r.u.dot(p);
        y[k] = r.v.dot(p);
        z[k] = -r.toward.dot(p);
      }
      r.along_u = quantiles(x);
      r.along_v = quantiles(y);
      std::nth_element(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2), z.end());
      r.depth = z[z.size() / 2];
      out.push_back(r);
    }
  return out;
}

}  // namespace

void hypotheses_from_regions(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out) {
  // Edges and drop-outs eat a piece of a region's rim, a touching neighbour adds one.
  constexpr double kSmallest = 0.6, kLargest = 1.3;
  const auto fits = [](const Vec2& seen, const Vec2& nominal) {
    const double ratio = (seen[1] - seen[0]) / (nominal[1] - nominal[0]);
    return ratio > kSmallest && ratio < kLargest;
  };
  for (const Region& region : regions(scene, part)) {
    for (const PartView& view : part.views) {
      if (view.points.empty()) continue;
      Vec3 pu, pv;
      orthonormal_basis(view.direction, pu, pv);
      double middle_depth = 0;
      for (const Vec3f& p : view.points) middle_depth -= view.direction.dot(p.cast<double>());
      middle_depth /= static_cast<double>(view.points.size());
      for (int k = 0; k < kViewAngles; ++k) {
        // Part direction a(k) = pu cos + pv sin comes to lie on the region's u, a(k + 90 deg) on its v.
        const Vec2& along_u = view.extents[static_cast<std::size_t>(k)];
        const Vec2& along_v = view.extents[static_cast<std::size_t>((k + kViewAngles / 4) % kViewAngles)];
        if (!fits(region.along_u, along_u) || !fits(region.along_v, along_v)) continue;
        const double a = 2 * kPi * k / kViewAngles;
        const Vec3 part_u = pu * std::cos(a) + pv * std::sin(a), part_v = pv * std::cos(a) - pu * std::sin(a);
        const Matrix3 r = rotation_from_directions(view.direction, part_u, region.toward, region.u);
        const Vec3 part_point = part_u * along_u.mean() + part_v * along_v.mean() - view.direction * middle_depth;
        const Vec3 scene_point =
            region.u * region.along_u.mean() + region.v * region.along_v.mean() - region.toward * region.depth;
        out.push_back(pose_from(r, part_point, scene_point));
      }
    }
  }
}

bool anything_left(const SceneFeatures& scene, const Part& part) { return !regions(scene, part).empty(); }

void hypotheses_from_sweep(const SceneFeatures& scene, const Part& part, std::vector<Pose>& out) {
  constexpr int kSpins = 12;
  const Surfels& surfels = *scene.surfels;
  // Anchors a fifth of the diameter apart: the look-up settles a tenth.
  const double spacing = 0.2 * part.diameter_mm;
  std::vector<Vec3> anchors;
  for (const Region& region : regions(scene, part))
    for (const std::int32_t s : region.surfels) {
      const Vec3 p = surfels.position[static_cast<std::size_t>(s)].cast<double>();
      if (std::none_of(anchors.begin(), anchors.end(),
                       [&](const Vec3& a) { return (a - p).squaredNorm() < spacing * spacing; }))
        anchors.push_back(p);
    }
  for (const Vec3& anchor : anchors) {
    const Vec3 toward = Vec3(-Eigen::Vector3d(anchor).normalized());
    Vec3 su, sv;
    orthonormal_basis(toward, su, sv);
    for (const PartView& view : part.views) {
      if (view.points.empty()) continue;
      Vec3 pu, pv;
      orthonormal_basis(view.direction, pu, pv);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const Vec3f& p : view.points) mean += p.cast<double>();
      mean /= static_cast<double>(view.points.size());
      for (int k = 0; k < kSpins; ++k) {
        const double a = 2 * kPi * k / kSpins;
        const Matrix3 r = rotation_from_directions(view.direction, pu, toward, su * std::cos(a) + sv * std::sin(a));
        out.push_back(pose_from(r, Vec3(mean), anchor));
      }
    }
  }
}

}  // namespace tribin
