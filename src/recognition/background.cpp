#include <algorithm>
#include <array>
#include <numeric>

#include "hypotheses.hpp"

// What is too large for a part: tables, floors, walls of bins. Where parts hide them here and there they are seen in
// pieces, each small enough for a part.
namespace tribin {
namespace {

constexpr double kLarger = 1.1;     // noise and a merged neighbour add a tenth
constexpr double kOffPlane = 0.01;  // of the diameter, by which nothing goes on in a plane: less than a part is thick

/// Is one plane the other's going on, behind what stands in front? Within 3 deg: what a warped wall bends and a small
/// piece's normal is unsure by.
bool goes_on_in(const SceneFeature& f, const SceneFeature& g, double off_plane_mm) {
  return f.primitive->axis.dot(g.primitive->axis) > std::cos(3 * kDegree) &&
         std::abs(f.primitive->axis.dot(g.centroid - f.centroid)) < off_plane_mm &&
         std::abs(g.primitive->axis.dot(f.centroid - g.centroid)) < off_plane_mm;
}

using Sheet = std::vector<const SceneFeature*>;

/// The planes of the scan, those that go on in each other together.
std::vector<Sheet> sheets_of(const SceneFeatures& scene, double off_plane_mm) {
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
      if (goes_on_in(*planes[i], *planes[k], off_plane_mm)) root[find(i)] = find(k);
  std::vector<Sheet> sheets(planes.size());
  for (std::size_t i = 0; i < planes.size(); ++i) sheets[find(i)].push_back(planes[i]);
  std::erase_if(sheets, [](const Sheet& s) { return s.empty(); });
  return sheets;
}

/// Largest distance between two of a sheet's points [mm].
double extent_mm(const Sheet& sheet) {
  std::vector<Vec3f> ends;
  for (const SceneFeature* f : sheet) ends.insert(ends.end(), f->ends.begin(), f->ends.end());
  float largest = 0;
  for (std::size_t i = 0; i < ends.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) largest = std::max(largest, (ends[i] - ends[k]).squaredNorm());
  return std::sqrt(largest);
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

Border border_of(const SceneFeatures& scene, const Sheet& sheet, double off_plane_mm) {
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
        // The image's border, where cells have no surfel, is no border of a floor.
        bool going_on = !grid.contains(i + 3 * d[0], j + 3 * d[1]);
        for (; grid.contains(x, y); x += d[0], y += d[1]) {
          if (grid(x, y) < 0) continue;
          height = largest.primitive->axis.dot(surfels.position[static_cast<std::size_t>(grid(x, y))].cast<double>()) -
                   largest.primitive->offset_mm;
          going_on = own.holds(grid.index(x, y)) || (std::abs(height) < off_plane_mm && ++mixed > kMixed);
          if (going_on || std::abs(height) >= off_plane_mm) break;
        }
        if (going_on) continue;
        ++(!grid.contains(x, y) ? border.nothing : height > 0 ? border.nearer : border.farther);
      }
    }
  return border;
}

/// Ids of the primitives that are too large for the part, as flags. Bottoms and upright planes that are longer than any
/// face of it, or go on in each other over as much, are floors and walls; not other level ones, for plates that lie
/// side by side have their upper faces in one plane.
std::vector<bool> background_flags(const SceneFeatures& scene, const Part& part) {
  const double longest_mm = kLarger * part.largest_face_mm;
  std::vector<bool> background = scene.floor;
  background.resize(scene.primitives->items.size() + 1, false);
  const auto flagged = [&](int id) -> std::vector<bool>::reference { return background[static_cast<std::size_t>(id)]; };
  for (const SceneFeatures::Bottom& bottom : scene.bottoms)
    if (bottom.extent_mm > longest_mm)
      for (const int id : bottom.primitives) flagged(id) = true;
  const SceneFeature* ground = nullptr;
  for (const SceneFeature& f : scene.features) {
    // A piece of a part reaches at most its diameter from its own centroid.
    if (f.reach_mm > kLarger * part.diameter_mm) flagged(f.primitive->id) = true;
    if (flagged(f.primitive->id) && f.primitive->type == PrimitiveType::plane &&
        (ground == nullptr || f.primitive->surfels.size() > ground->primitive->surfels.size()))
      ground = &f;
  }
  if (ground == nullptr) return background;
  constexpr double kDraft = 20 * kDegree;  // of the walls of bins
  for (const Sheet& sheet : sheets_of(scene, kOffPlane * part.diameter_mm))
    if (std::abs(sheet[0]->primitive->axis.dot(ground->primitive->axis)) < std::sin(kDraft) &&
        extent_mm(sheet) > longest_mm)
      for (const SceneFeature* f : sheet) flagged(f->primitive->id) = true;
  return background;
}

/// The cells of some primitives, as flags.
Image<std::uint8_t> cells_of(const SceneFeatures& scene, const std::vector<bool>& primitives) {
  const Image<std::int32_t>& label = scene.label_of_cell;
  Image<std::uint8_t> out(label.width, label.height, 0);
  for (std::size_t i = 0; i < label.size(); ++i) out.data[i] = primitives[static_cast<std::size_t>(label.data[i])];
  return out;
}

}  // namespace

Image<std::uint8_t> background_cells(const SceneFeatures& scene, const Part& part) {
  const Image<std::int32_t>& grid = scene.surfels->surfel_of_cell;
  Image<std::uint8_t> out = cells_of(scene, background_flags(scene, part));
  // Noise that hides 6 % of the part's size (4 sigma) lets everything look like it: such places say nothing of this
  // part.
  const double loudest = 0.015 * part.diameter_mm;
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (grid.data[i] >= 0)
      out.data[i] = out.data[i] || local_sigma_mm(*scene.surfels, i) > loudest || scene.claimed.holds(i);
  return out;
}

void find_floors(SceneFeatures& scene, std::span<const Part> parts, double sigma_mm) {
  scene.bottoms.clear();
  scene.floor.assign(scene.primitives->items.size() + 1, false);
  double smallest = 1e30, shortest = 1e30, longest = 0;
  for (const Part& part : parts) {
    smallest = std::min(smallest, part.diameter_mm);
    shortest = std::min(shortest, part.largest_face_mm);
    longest = std::max(longest, part.largest_face_mm);
  }
  // Of a floor in pieces, each is fitted by itself, and a smooth error of the sensor is as large as its noise.
  const double off_plane_mm = std::max(kOffPlane * smallest, 2 * sigma_mm);
  for (const Sheet& sheet : sheets_of(scene, off_plane_mm)) {
    SceneFeatures::Bottom bottom;
    bottom.extent_mm = extent_mm(sheet);
    if (bottom.extent_mm <= kLarger * shortest || !border_of(scene, sheet, off_plane_mm).of_floor()) continue;
    for (const SceneFeature* f : sheet) {
      bottom.primitives.push_back(f->primitive->id);
      if (bottom.extent_mm > kLarger * longest) scene.floor[static_cast<std::size_t>(f->primitive->id)] = true;
    }
    scene.bottoms.push_back(std::move(bottom));
  }
}

Image<std::uint8_t> floor_cells(const SceneFeatures& scene) { return cells_of(scene, scene.floor); }

}  // namespace tribin
