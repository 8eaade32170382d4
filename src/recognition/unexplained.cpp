#include "tribin/recognition/unexplained.hpp"

#include <algorithm>

#include "hypotheses.hpp"
#include "tribin/recognition/bin.hpp"

namespace tribin {
namespace {

double mean_view_area(const Part& part) {
  double sum = 0;
  for (const PartView& v : part.views) sum += v.area_mm2;
  return sum / static_cast<double>(part.views.size());
}

/// A crumb is less than a seventh of what the part shows on average: the rim of something explained.
double least_piece_mm2(const Part& part) { return mean_view_area(part) / 7; }

/// The surfels of the connected pieces of what is no ground, each at least so large as the camera sees it.
std::vector<std::vector<std::uint32_t>> connected_pieces(const Surfels& surfels, const Image<std::uint8_t>& ground,
                                                         double least_mm2) {
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  Image<std::uint8_t> taken(grid.width, grid.height, 0);
  std::vector<std::vector<std::uint32_t>> out;
  std::vector<std::pair<int, int>> stack;
  std::vector<std::uint32_t> members;
  const auto foreground = [&](int i, int j) { return grid(i, j) >= 0 && !ground(i, j); };
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
      const double pitch = surfels.position[members[0]].z() / surfels.scan->camera.fx * surfels.cell_px;
      constexpr std::size_t kFewest = 20;  // fewer say nothing of any part
      if (members.size() >= kFewest && static_cast<double>(members.size()) * pitch * pitch >= least_mm2)
        out.push_back(members);
    }
  return out;
}

}  // namespace

std::vector<std::uint32_t> unexplained_surfels(const SceneFeatures& scene, const Image<std::uint8_t>& background,
                                               const Part& part) {
  std::vector<std::uint32_t> out;
  for (const std::vector<std::uint32_t>& piece : connected_pieces(*scene.surfels, background, least_piece_mm2(part)))
    out.insert(out.end(), piece.begin(), piece.end());
  return out;
}

std::vector<UnexplainedRegion> unexplained_regions(const SceneFeatures& scene, std::span<const Part> parts,
                                                   const CellMask& explained, const BinSighting* bin,
                                                   const Image<std::uint8_t>& in_bin) {
  if (parts.empty()) return {};
  const Surfels& surfels = *scene.surfels;
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  const auto larger = [](const Part& a, const Part& b) { return a.diameter_mm < b.diameter_mm; };
  double least_mm2 = 1e300;
  for (const Part& part : parts) least_mm2 = std::min(least_mm2, least_piece_mm2(part));
  // In a known bin whatever is off its floor and walls counts; else what is no larger than the parts are.
  Image<std::uint8_t> ground(grid.width, grid.height, 0);
  if (bin != nullptr) {
    for (std::size_t i = 0; i < ground.size(); ++i) ground.data[i] = !in_bin.data[i];
  } else {
    SceneFeatures unclaimed = scene;
    unclaimed.claimed = {};
    ground = background_cells(unclaimed, *std::max_element(parts.begin(), parts.end(), larger));
  }
  // Around what a part explains, two cells are those that its edge spoils.
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      if (!explained.holds(static_cast<std::size_t>(j) * grid.width + i)) continue;
      for (int y = std::max(0, j - 2); y <= std::min(grid.height - 1, j + 2); ++y)
        for (int x = std::max(0, i - 2); x <= std::min(grid.width - 1, i + 2); ++x) ground(x, y) = 1;
    }
  std::optional<Ground> floor;
  if (bin != nullptr) {
    const Vec3 up = bin->camera_from_bin.linear().col(2);
    floor = Ground{up, up.dot(bin->camera_from_bin.translation())};
  }
  std::vector<UnexplainedRegion> out;
  for (const std::vector<std::uint32_t>& piece : connected_pieces(surfels, ground, least_mm2))
    out.push_back(region_of(surfels, piece, bin ? floor : ground_around(surfels, *scene.primitives, piece)));
  std::stable_sort(out.begin(), out.end(), [](const UnexplainedRegion& a, const UnexplainedRegion& b) {
    return a.volume_mm3 != b.volume_mm3 ? a.volume_mm3 > b.volume_mm3 : a.pixels > b.pixels;
  });
  return out;
}

std::optional<Ground> ground_around(const Surfels& surfels, const Primitives& primitives,
                                    std::span<const std::uint32_t> members) {
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  CellMask own = CellMask::none_of(grid.size());
  for (const std::uint32_t s : members) own.add(surfels.cell[s]);
  // The planes of the cells within six of it: as far as an edge and its shadow spoil, mostly.
  constexpr int kReach = 6;
  std::vector<int> met(primitives.items.size() + 1, 0);
  for (const std::uint32_t s : members) {
    const int i = static_cast<int>(surfels.cell[s]) % grid.width, j = static_cast<int>(surfels.cell[s]) / grid.width;
    for (const auto& [x, y] : {std::pair{i - kReach, j}, {i + kReach, j}, {i, j - kReach}, {i, j + kReach}}) {
      if (!grid.contains(x, y) || grid(x, y) < 0 || own.holds(static_cast<std::size_t>(y) * grid.width + x)) continue;
      const int label = primitives.label_of_surfel[static_cast<std::size_t>(grid(x, y))];
      if (label > 0 && primitives.items[static_cast<std::size_t>(label) - 1].type == PrimitiveType::plane)
        ++met[static_cast<std::size_t>(label)];
    }
  }
  const auto most = std::max_element(met.begin(), met.end());
  if (*most == 0) return {};
  const Primitive& plane = primitives.items[static_cast<std::size_t>(most - met.begin()) - 1];
  return Ground{plane.axis, plane.offset_mm};
}

UnexplainedRegion region_of(const Surfels& surfels, std::span<const std::uint32_t> members,
                            const std::optional<Ground>& ground) {
  UnexplainedRegion out;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const std::uint32_t s : members) {
    const Eigen::Vector3d p = surfels.position[s].cast<double>();
    const int points = static_cast<int>(surfels.points[s]);
    out.pixels += points;
    sum += points * p;
    if (ground)
      out.volume_mm3 += std::max(0.0, ground->up.dot(p) - ground->offset_mm) * surfels.area_mm2[s] *
                        std::abs(ground->up.dot(surfels.normal[s].cast<double>()));
  }
  if (out.pixels > 0) out.center_mm = sum / out.pixels;
  return out;
}

}  // namespace tribin
