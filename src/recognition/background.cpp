#include <algorithm>
#include <array>
#include <numeric>

#include "hypotheses.hpp"

// What is too large for a part: tables, floors, walls of bins. Where parts hide them here and there they are seen in
// pieces, each small enough for a part.
namespace tribin {
namespace {

/// A piece of a part reaches at most its diameter from its own centroid; noise and a merged neighbour add a little.
double furthest_reach_mm(const Part& part) { return 1.1 * part.diameter_mm; }

/// By the part's thickness nothing else goes on in a plane.
double off_plane_mm(const Part& part) { return 0.01 * part.diameter_mm; }

/// Is one plane the other's going on, behind what stands in front? Within 3 deg: what a warped wall bends and a small
/// piece's normal is unsure by.
bool goes_on_in(const SceneFeature& f, const SceneFeature& g, const Part& part) {
  return f.primitive->axis.dot(g.primitive->axis) > std::cos(3 * kDegree) &&
         std::abs(f.primitive->axis.dot(g.centroid - f.centroid)) < off_plane_mm(part) &&
         std::abs(g.primitive->axis.dot(f.centroid - g.centroid)) < off_plane_mm(part);
}

double reach_together_mm(const SceneFeature& f, const SceneFeature& g) {
  return 0.5 * ((f.centroid - g.centroid).norm() + f.reach_mm + g.reach_mm);
}

using Sheet = std::vector<const SceneFeature*>;

/// The planes of the scan, those that go on in each other together.
std::vector<Sheet> sheets_of(const SceneFeatures& scene, const Part& part) {
  Sheet planes;
  for (const SceneFeature& f : scene.features)
    if (f.primitive->type == PrimitiveType::plane) planes.push_back(&f);
  std::vector<std::size_t> root(planes.size());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  for (std::size_t i = 0; i < planes.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (goes_on_in(*planes[i], *planes[k], part)) root[find(i)] = find(k);
  std::vector<Sheet> sheets(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) sheets[find(i)].push_back(planes[i]);
  std::erase_if(sheets, [](const Sheet& s) { return s.empty(); });
  return sheets;
}

bool larger_than(const Sheet& sheet, const Part& part) {
  for (const SceneFeature* f : sheet)
    for (const SceneFeature* g : sheet)
      if (reach_together_mm(*f, *g) > furthest_reach_mm(part)) return true;
  return false;
}

/// What lies beside a sheet, in cells of its border: nearer than its plane, farther, or nothing at all.
struct Border {
  int nearer = 0, farther = 0, nothing = 0;

  /// A floor ends where something stands on it, and nothing is seen behind it: the faces of parts end before what lies
  /// behind them. One in twenty is left to flying pixels; where nothing is measured around it, nobody knows.
  bool of_floor() const {
    const int all = nearer + farther + nothing;
    return 20 * farther <= all && 10 * nearer >= 7 * all;
  }
};

Border border_of(const SceneFeatures& scene, const Sheet& sheet, const Part& part) {
  const Surfels& surfels = *scene.surfels;
  const Image<std::int32_t>& grid = surfels.surfel_of_cell;
  const SceneFeature& largest =
      **std::max_element(sheet.begin(), sheet.end(), [](const SceneFeature* a, const SceneFeature* b) {
        return a->primitive->surfels.size() < b->primitive->surfels.size();
      });
  CellMask own = CellMask::none_of(grid.size());
  for (const SceneFeature* f : sheet)
    for (const std::uint32_t s : f->primitive->surfels) own.add(surfels.cell[s]);
  constexpr std::array<std::array<int, 2>, 4> kSides = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  constexpr int kMixed = 2;  // cells in the plane that are no piece of it: an edge spoils them
  Border border;
  for (const SceneFeature* f : sheet)
    for (const std::uint32_t s : f->primitive->surfels) {
      const int i = static_cast<int>(surfels.cell[s]) % grid.width, j = static_cast<int>(surfels.cell[s]) / grid.width;
      for (const auto& d : kSides) {
        // Across what is not measured, for a shade is as wide as what throws it is high.
        int mixed = 0, x = i + d[0], y = j + d[1];
        double height = 0;
        bool going_on = false;
        for (; grid.contains(x, y); x += d[0], y += d[1]) {
          if (grid(x, y) < 0) continue;
          height = largest.primitive->axis.dot(surfels.position[static_cast<std::size_t>(grid(x, y))].cast<double>()) -
                   largest.primitive->offset_mm;
          going_on = own.holds(grid.index(x, y)) || (std::abs(height) < off_plane_mm(part) && ++mixed > kMixed);
          if (going_on || std::abs(height) >= off_plane_mm(part)) break;
        }
        if (going_on) continue;
        ++(!grid.contains(x, y) ? border.nothing : height > 0 ? border.nearer : border.farther);
      }
    }
  return border;
}

/// Ids of the primitives that are too large for the part, as flags. What goes on in pieces over more than a part is one
/// floor, where no piece ends before something farther away, and one wall, where it stands on what is too large by
/// itself: plates that lie side by side have their upper faces in one plane, and end before what they lie on.
std::vector<bool> background_flags(const SceneFeatures& scene, const Part& part) {
  std::vector<bool> background(scene.primitives->items.size() + 1, false);
  const auto flag = [&](const SceneFeature& f) { background[static_cast<std::size_t>(f.primitive->id)] = true; };
  const SceneFeature* floor = nullptr;
  for (const SceneFeature& f : scene.features) {
    if (f.reach_mm <= furthest_reach_mm(part)) continue;
    flag(f);
    if (f.primitive->type == PrimitiveType::plane &&
        (floor == nullptr || f.primitive->surfels.size() > floor->primitive->surfels.size()))
      floor = &f;
  }
  constexpr double kDraft = 20 * kDegree;  // of the walls of bins
  for (const Sheet& sheet : sheets_of(scene, part)) {
    if (sheet.size() < 2 || !larger_than(sheet, part)) continue;
    const bool upright =
        floor != nullptr && std::abs(sheet[0]->primitive->axis.dot(floor->primitive->axis)) < std::sin(kDraft);
    if (upright || border_of(scene, sheet, part).of_floor())
      for (const SceneFeature* f : sheet) flag(*f);
  }
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

}  // namespace tribin
