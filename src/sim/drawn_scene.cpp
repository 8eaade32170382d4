#include "sim/drawn_scene.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "sim/foreign_objects.hpp"
#include "sim/random.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/sim/table_scene.hpp"

namespace tribin::sim {
namespace {

constexpr double kTableAlbedo = 0.2;             // a dark work bench: 2.5 times the noise of a bright part
constexpr double kBinAlbedo = 0.25;              // grey plastic
constexpr double kNearest = 560;                 // mm, at which a sensor of 180 mm baseline is focused
constexpr int kFewestAlone = 3, kMostAlone = 8;  // foreign objects in a bin that holds nothing else
constexpr double kShareOfView =
    0.9;  // of the table's view in which parts may lie: tall ones reach outwards in the image

/// Which parts lie in a scene: indices, drawn from the classes that the level allows. A cell has one camera, chosen for
/// its smallest part: no class of a scene is more than three times as large as another.
std::vector<int> drawn_parts(const LevelSettings& level, std::span<const double> diameters_mm, Random& random) {
  constexpr double kLargestRatio = 3;
  const int classes = static_cast<int>(diameters_mm.size());
  std::vector<int> order(classes);
  for (int i = 0; i < classes; ++i) order[i] = i;
  for (int i = classes - 1; i > 0; --i) std::swap(order[i], order[random.integer(0, i)]);
  double smallest = diameters_mm[order[0]], largest = smallest;
  std::erase_if(order, [&](int k) {
    const double low = std::min(smallest, diameters_mm[k]), high = std::max(largest, diameters_mm[k]);
    if (high > kLargestRatio * low) return true;
    smallest = low, largest = high;
    return false;
  });
  const int most = static_cast<int>(order.size());
  order.resize(random.integer(std::min(most, level.fewest_classes), std::min(most, level.most_classes)));
  std::vector<int> drawn(random.integer(level.fewest_parts, level.most_parts));
  for (int& part : drawn) part = order[random.integer(0, static_cast<int>(order.size()) - 1)];
  return drawn;
}

/// Distance at which the parts' bounding circles take about half of the view.
double distance_above_table(const std::vector<TablePart>& parts, const PinholeCamera& camera) {
  double area = 0;
  for (const TablePart& p : parts) area += std::pow(2 * radius_from_above(*p.mesh, p.rests->front()), 2);
  const double view = camera.width / camera.fx * camera.height / camera.fy;  // of the table at 1 mm
  return std::clamp(std::sqrt(2 * area / view), kNearest, 1500.0);           // beyond, 16 bit and noise end
}

StructuredLight sensor_of(const LevelSettings& level, Random& random) {
  StructuredLight sensor;
  sensor.image_noise = level.image_noise;
  sensor.noise_correlation_px = level.correlation_px;
  sensor.systematic = level.systematic;
  sensor.highlight = level.highlight;
  sensor.mirror_share = level.mirror_share;
  sensor.lost_share = level.lost_high > 0 ? random.uniform(level.lost_low, level.lost_high) : 0;
  return sensor;
}

/// One class, one finish: from painted dark to bright cast metal.
std::vector<double> drawn_albedos(std::size_t classes, Random& random) {
  std::vector<double> albedo(classes);
  for (double& a : albedo) a = random.uniform(0.2, 0.6);
  return albedo;
}

constexpr double kPacking = 0.5;  // of the hulls of dropped parts

struct Footprint {
  double length, width;
};

/// The inside of a bin that holds the parts: the smallest of the sizes that are sold in which the heap is no higher
/// than 0.45 of its width: crates for parts are wider than deep, or no camera sees their floor. Dropped parts fill
/// about half of their heap with their hulls.
Footprint bin_for(const std::vector<const Solid*>& parts) {
  constexpr Footprint kSizes[] = {{160, 110}, {243, 162}, {346, 265}, {544, 364}, {750, 550}, {1150, 750}};
  constexpr double kHighest = 0.45, kRoom = 1.15;
  double volume = 0, largest = 0;
  for (const Solid* p : parts) volume += p->hull_volume_mm3(), largest = std::max(largest, p->diameter_mm());
  for (const Footprint& f : kSizes)
    if (f.width >= kRoom * largest && volume / kPacking <= f.length * f.width * kHighest * f.width) return f;
  // Larger than any: as a cube of that height would be, and room to turn.
  const double side = std::max(kRoom * largest, std::cbrt(volume / kPacking / kHighest / 1.5));
  return {1.5 * side, side};
}

/// The least distance at which the bin is wholly in view, with 3 % of the image to spare.
double distance_above_bin(const Bin& bin, const PinholeCamera& camera, double tilt, double azimuth,
                          const Pose& turned) {
  double distance = std::max(kNearest, bin.height_mm + 0.8 * kNearest);
  const auto fits = [&] {
    const Pose camera_from_bin = camera_above(distance, tilt, azimuth) * turned;
    const double x = bin.length_mm / 2 + bin.wall_mm, y = bin.width_mm / 2 + bin.wall_mm;
    for (int i = 0; i < 8; ++i) {
      const Vec2 q =
          camera.project(camera_from_bin * Vec3(i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? bin.height_mm : -bin.wall_mm));
      if (std::abs(q.x() - camera.cx) > 0.47 * camera.width || std::abs(q.y() - camera.cy) > 0.47 * camera.height)
        return false;
    }
    return true;
  };
  while (!fits()) distance *= 1.01;
  return distance;
}

/// What lies in a bin.
struct Item {
  const Solid* solid;
  int object;  ///< BOP obj_id, 0 = foreign
};
struct Heap {
  std::vector<Item> items;
  int foreign = 0;
  Footprint inside{};
  BinFill fill;
};

std::vector<const Solid*> solids_of(const std::vector<Item>& items) {
  std::vector<const Solid*> solids;
  for (const Item& item : items) solids.push_back(item.solid);
  return solids;
}

/// As many items as the bin holds, the first ones: by volume, then by what leans on the walls, which end at the rim.
void fill_given_bin(const Bin& bin, Heap& heap, std::uint64_t seed) {
  double room = kPacking * bin.length_mm * bin.width_mm * bin.height_mm;
  std::size_t count = 0;
  while (count < heap.items.size() && (room -= heap.items[count].solid->hull_volume_mm3()) >= 0) ++count;
  for (bool fits = false; !fits; count -= (count + 3) / 4) {
    if (count == 0 && !heap.items.empty())
      throw Error(ErrorCode::out_of_range, "simulate: no part fits into the cell's bin of " +
                                               std::to_string(std::lround(bin.length_mm)) + " x " +
                                               std::to_string(std::lround(bin.width_mm)) + " x " +
                                               std::to_string(std::lround(bin.height_mm)) + " mm; wanted a larger one");
    heap.items.resize(count, Item{nullptr, 0});
    heap.fill = fill_bin(solids_of(heap.items), bin.length_mm, bin.width_mm, seed);
    fits = heap.fill.wall_contact_mm <= bin.height_mm;
    if (fits) break;
  }
  heap.foreign = static_cast<int>(
      std::count_if(heap.items.begin(), heap.items.end(), [](const Item& i) { return i.object == 0; }));
}

Heap draw_heap(const SceneStock& stock, SceneKind kind, const LevelSettings& level, Random& random,
               const std::optional<CellView>& cell) {
  Heap heap;
  for (const int k : drawn_parts(level, stock.diameters_mm, random)) heap.items.push_back({&stock.solids[k], k + 1});
  std::vector<const Solid*> solids = solids_of(heap.items);
  if (kind != SceneKind::bin) heap.items.clear();  // the parts that are not there still tell how large the bin is
  // Foreign objects fall at any time among the parts.
  heap.foreign = kind == SceneKind::foreign ? random.integer(kFewestAlone, kMostAlone)
                 : kind == SceneKind::empty || level.most_foreign == 0
                     ? 0
                     : random.integer(level.fewest_foreign, level.most_foreign);
  for (int i = 0; i < heap.foreign; ++i) {
    const Item item{&stock.foreign[random.integer(0, static_cast<int>(stock.foreign.size()) - 1)], 0};
    heap.items.insert(heap.items.begin() + random.integer(0, static_cast<int>(heap.items.size())), item);
    if (kind == SceneKind::bin) solids.push_back(item.solid);
  }
  if (cell) {
    fill_given_bin(cell->bin, heap, random.bits());
    return heap;
  }
  heap.inside = bin_for(solids);
  heap.fill = fill_bin(solids_of(heap.items), heap.inside.length, heap.inside.width, random.bits());
  return heap;
}

// Sensors for larger bins have wider baselines: beyond 800 mm the angle between camera and projector stays.
double baseline_scale(double distance_mm) { return std::max(1.0, distance_mm / 800); }

BinView drawn_view(const Heap& heap, const LevelSettings& level, Random& random, StructuredLight& sensor) {
  // The rim is as high as any part leans on the walls at least; bins are filled to the brim, or hardly half.
  BinView view;
  view.bin = {heap.inside.length, heap.inside.width, 0, 5};
  Bin& bin = view.bin;
  bin.height_mm = std::max({40.0, heap.fill.wall_contact_mm + 5, heap.fill.top_mm * random.uniform(0.7, 1.5)});
  sensor = sensor_of(level, random);
  Pose turned = Pose::Identity();  // bins stand nearly square to the camera, either way round
  turned.linear() = rotation_from_vector(Vec3(0, 0, random.uniform(-5, 5) * kDegree + random.integer(0, 1) * kPi));
  const double tilt = random.uniform(0, level.max_tilt), azimuth = random.uniform(0, 2 * kPi);
  view.distance_mm = distance_above_bin(bin, sensor.camera, tilt, azimuth, turned);
  view.camera_from_bin = camera_above(view.distance_mm, tilt, azimuth) * turned;
  view.farthest_mm = 1.25 * view.distance_mm;
  sensor.reference_mm = view.distance_mm - heap.fill.top_mm / 2;
  sensor.baseline_mm *= baseline_scale(view.distance_mm);
  return view;
}

}  // namespace

BinView view_of_cell(const CellView& cell, double top_mm, const LevelSettings& level, Random& random,
                     StructuredLight& sensor) {
  sensor = sensor_of(level, random);
  sensor.camera = cell.camera;
  if (cell.noise.sigma_mm > 0) sensor.noise_mm = cell.noise.sigma_mm;
  if (cell.noise.correlation_px >= 0) sensor.noise_correlation_px = cell.noise.correlation_px;
  const Vec3 floor = cell.camera_from_bin.translation();
  const Vec2 pixel = floor.z() > 0 ? cell.camera.project(floor) : Vec2(-1, -1);
  if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < cell.camera.width && pixel.y() < cell.camera.height))
    throw Error(ErrorCode::out_of_range,
                "simulate: the camera of the cell does not see the middle of its bin's floor, which lies at " +
                    std::to_string(floor.x()) + ", " + std::to_string(floor.y()) + ", " + std::to_string(floor.z()) +
                    " mm in its frame; wanted it in view (camera.file, hand_eye, bin.base_from_bin)");
  constexpr double kTableSides = 4;  // of the bin's length: what stands around a bin
  BinView view{cell.bin, cell.camera_from_bin, floor.z(), 0,
               kTableSides * std::max(cell.bin.length_mm, cell.bin.width_mm)};
  for (int i = 0; i < 4; ++i) {
    const double half = view.table_side_mm / 2;
    const Vec3 corner = cell.camera_from_bin * Vec3(i & 1 ? half : -half, i & 2 ? half : -half, -cell.bin.wall_mm);
    view.farthest_mm = std::max(view.farthest_mm, 1.25 * corner.z());
  }
  sensor.reference_mm = (cell.camera_from_bin * Vec3(0, 0, top_mm / 2)).z();
  sensor.baseline_mm *= baseline_scale(view.distance_mm);
  return view;
}

std::vector<Mesh> bin_and_table_meshes(const BinView& view) {
  return {bin_mesh(view.bin), table_mesh(view.table_side_mm)};
}

std::vector<Body> table_and_bin(const BinView& view, const std::vector<Mesh>& meshes) {
  Pose below = Pose::Identity();
  below.translation().z() = -view.bin.wall_mm - 1;  // under the bin's feet, so that the two planes do not fight
  return {{&meshes[1], view.camera_from_bin * below, kTableAlbedo, /*shine=*/0, /*counted=*/false},
          {meshes.data(), view.camera_from_bin, kBinAlbedo, /*shine=*/0, /*counted=*/false}};
}

SceneStock make_stock(const std::vector<Mesh>& parts, SceneKind kind, const LevelSettings& level) {
  SceneStock stock;
  stock.parts = &parts;
  stock.table = table_mesh();
  for (const Mesh& part : parts) stock.diameters_mm.push_back(diameter(part.vertices));
  if (kind == SceneKind::table) {
    for (const Mesh& part : parts) stock.rests.push_back(stable_rests(part));
    return stock;
  }
  for (const Mesh& part : parts) stock.solids.emplace_back(part);
  if (level.most_foreign > 0 || kind == SceneKind::foreign) {
    std::vector<double> diameters = stock.diameters_mm;
    std::nth_element(diameters.begin(), diameters.begin() + diameters.size() / 2, diameters.end());
    stock.foreign_meshes = foreign_objects(diameters[diameters.size() / 2]);
    for (const Mesh& mesh : stock.foreign_meshes) stock.foreign.emplace_back(mesh);
  }
  return stock;
}

DrawnScene draw_table_scene(const SceneStock& stock, const LevelSettings& level, std::uint64_t seed) {
  Random random(seed);
  const std::vector<Mesh>& meshes = *stock.parts;
  const std::vector<int> drawn = drawn_parts(level, stock.diameters_mm, random);
  std::vector<TablePart> parts;
  for (const int k : drawn) parts.push_back({&meshes[k], &stock.rests[k]});

  DrawnScene scene;
  scene.sensor = sensor_of(level, random);
  StructuredLight& sensor = scene.sensor;
  sensor.reference_mm = distance_above_table(parts, sensor.camera);
  scene.camera_from_world =
      camera_above(sensor.reference_mm, random.uniform(0, level.max_tilt), random.uniform(0, 2 * kPi));
  const double half = 0.5 * kShareOfView * sensor.reference_mm;
  const Layout layout = lay_on_table(parts, half * sensor.camera.width / sensor.camera.fx,
                                     half * sensor.camera.height / sensor.camera.fy, random.bits());
  scene.bodies = {{&stock.table, scene.camera_from_world, kTableAlbedo, /*shine=*/0, /*counted=*/false}};
  scene.object_of_body = {0};
  const std::vector<double> albedo = drawn_albedos(meshes.size(), random);
  for (std::size_t i = 0; i < layout.laid.size(); ++i) {
    const int k = drawn[layout.laid[i]];
    scene.bodies.push_back({&meshes[k], scene.camera_from_world * layout.table_from_part[i], albedo[k], 1});
    scene.object_of_body.push_back(k + 1);
  }
  // The table's far corner under the largest tilt of any level is within 1.25 of the distance.
  scene.largest_depth_mm = 1.25 * sensor.reference_mm;
  scene.info["distance_mm"] = sensor.reference_mm;
  return scene;
}

DrawnScene draw_bin_scene(const SceneStock& stock, SceneKind kind, const LevelSettings& level, std::uint64_t seed,
                          const std::optional<CellView>& cell) {
  Random random(seed);
  const Heap heap = draw_heap(stock, kind, level, random, cell);
  DrawnScene scene;
  const BinView view = cell ? view_of_cell(*cell, heap.fill.top_mm, level, random, scene.sensor)
                            : drawn_view(heap, level, random, scene.sensor);
  scene.camera_from_world = view.camera_from_bin;

  scene.own = bin_and_table_meshes(view);
  scene.bodies = table_and_bin(view, scene.own);
  scene.object_of_body = {0, 0};
  const std::vector<double> albedo = drawn_albedos(stock.parts->size(), random);
  for (std::size_t i = 0; i < heap.items.size(); ++i) {
    const int k = heap.items[i].object;
    scene.bodies.push_back({&heap.items[i].solid->mesh(), scene.camera_from_world * heap.fill.bin_from_part[i],
                            k > 0 ? albedo[k - 1] : random.uniform(0.1, 0.6), 1});
    scene.object_of_body.push_back(k);
  }
  scene.largest_depth_mm = view.farthest_mm;
  scene.info["distance_mm"] = view.distance_mm;
  scene.info["baseline_mm"] = scene.sensor.baseline_mm;
  scene.info["foreign"] = heap.foreign;
  scene.info["bin_inner_mm"] = {view.bin.length_mm, view.bin.width_mm, view.bin.height_mm};
  scene.info["wall_mm"] = view.bin.wall_mm;
  scene.info["max_overlap_mm"] = heap.fill.max_overlap_mm;
  scene.info["drift_mm"] = heap.fill.drift_mm;
  return scene;
}

}  // namespace tribin::sim
