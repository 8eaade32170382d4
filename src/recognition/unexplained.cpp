#include <algorithm>

#include "hypotheses.hpp"

namespace tribin {
namespace {

double mean_view_area(const Part& part) {
  double sum = 0;
  for (const PartView& v : part.views) sum += v.area_mm2;
  return sum / static_cast<double>(part.views.size());
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
      out.data[i] = local_sigma(*scene.surfels, i) > loudest || scene.claimed.holds(i) ||
                    background[static_cast<std::size_t>(
                        scene.primitives->label_of_surfel[static_cast<std::size_t>(grid.data[i])])];
  return out;
}

std::vector<std::uint32_t> unexplained_surfels(const SceneFeatures& scene, const Part& part) {
  const Surfels& surfels = *scene.surfels;
  const Image<std::uint8_t> background = background_cells(scene, part);
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  Image<std::uint8_t> taken(grid.width, grid.height, 0);
  std::vector<std::uint32_t> out;
  std::vector<std::pair<int, int>> stack;
  std::vector<std::uint32_t> members;
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
        members.push_back(static_cast<std::uint32_t>(grid(x, y)));
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
      const double pitch = surfels.position[members[0]].z() / surfels.scan->camera.fx * surfels.cell_px;
      if (members.size() < 20 || static_cast<double>(members.size()) * pitch * pitch < mean_view_area(part) / 7)
        continue;
      out.insert(out.end(), members.begin(), members.end());
    }
  return out;
}

}  // namespace tribin
