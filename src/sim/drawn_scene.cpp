#include "sim/drawn_scene.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "sim/foreign_objects.hpp"
#include "sim/random.hpp"
#include "tribin/cad/measure.hpp"
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

struct Footprint {
  double length, width;
};

/// The inside of a bin that holds the parts: the smallest of the sizes that are sold in which the heap is no higher
/// than 0.45 of its width: crates for parts are wider than deep, or no camera sees their floor. Dropped parts fill
/// about half of their heap with their hulls.
Footprint bin_for(const std::vector<const Solid*>& parts) {
  constexpr Footprint kSizes[] = {{160, 110}, {243, 162}, {346, 265}, {544, 364}, {750, 550}, {1150, 750}};
  constexpr double kPacking = 0.5, kHighest = 0.45, kRoom = 1.15;
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

}  // namespace

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

DrawnScene draw_bin_scene(const SceneStock& stock, SceneKind kind, const LevelSettings& level, std::uint64_t seed) {
  Random random(seed);
  const std::vector<Mesh>& meshes = *stock.parts;
  const std::vector<int> drawn = drawn_parts(level, stock.diameters_mm, random);
  struct Item {
    const Solid* solid;
    int object;
  };
  std::vector<Item> items;
  for (const int k : drawn) items.push_back({&stock.solids[k], k + 1});
  std::vector<const Solid*> solids;
  for (const Item& item : items) solids.push_back(item.solid);
  if (kind != SceneKind::bin) items.clear();  // the parts that are not there still tell how large the bin is
  // Foreign objects fall at any time among the parts.
  const int foreign = kind == SceneKind::foreign ? random.integer(kFewestAlone, kMostAlone)
                      : kind == SceneKind::empty || level.most_foreign == 0
                          ? 0
                          : random.integer(level.fewest_foreign, level.most_foreign);
  for (int i = 0; i < foreign; ++i) {
    const Item item{&stock.foreign[random.integer(0, static_cast<int>(stock.foreign.size()) - 1)], 0};
    items.insert(items.begin() + random.integer(0, static_cast<int>(items.size())), item);
    if (kind == SceneKind::bin) solids.push_back(item.solid);
  }
  const Footprint inside = bin_for(solids);
  solids.clear();
  for (const Item& item : items) solids.push_back(item.solid);
  const BinFill fill = fill_bin(solids, inside.length, inside.width, random.bits());

  // The rim is as high as any part leans on the walls at least; bins are filled to the brim, or hardly half.
  Bin bin{inside.length, inside.width, 0, 5};
  bin.height_mm = std::max({40.0, fill.wall_contact_mm + 5, fill.top_mm * random.uniform(0.7, 1.5)});
  DrawnScene scene;
  scene.sensor = sensor_of(level, random);
  StructuredLight& sensor = scene.sensor;
  Pose turned = Pose::Identity();  // bins stand nearly square to the camera, either way round
  turned.linear() = rotation_from_vector(Vec3(0, 0, random.uniform(-5, 5) * kDegree + random.integer(0, 1) * kPi));
  const double tilt = random.uniform(0, level.max_tilt), azimuth = random.uniform(0, 2 * kPi);
  const double distance = distance_above_bin(bin, sensor.camera, tilt, azimuth, turned);
  sensor.reference_mm = distance - fill.top_mm / 2;
  // Sensors for larger bins have wider baselines: beyond 800 mm the angle between camera and projector stays.
  sensor.baseline_mm *= std::max(1.0, distance / 800);
  scene.camera_from_world = camera_above(distance, tilt, azimuth) * turned;

  scene.own = {bin_mesh(bin)};
  Pose below = Pose::Identity();
  below.translation().z() = -bin.wall_mm - 1;  // under the bin's feet, so that the two planes do not fight
  scene.bodies = {{&stock.table, scene.camera_from_world * below, kTableAlbedo, /*shine=*/0, /*counted=*/false},
                  {scene.own.data(), scene.camera_from_world, kBinAlbedo, /*shine=*/0, /*counted=*/false}};
  scene.object_of_body = {0, 0};
  const std::vector<double> albedo = drawn_albedos(meshes.size(), random);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const int k = items[i].object;
    scene.bodies.push_back({&items[i].solid->mesh(), scene.camera_from_world * fill.bin_from_part[i],
                            k > 0 ? albedo[k - 1] : random.uniform(0.1, 0.6), 1});
    scene.object_of_body.push_back(k);
  }
  scene.largest_depth_mm = 1.25 * distance;
  scene.info["distance_mm"] = distance;
  scene.info["baseline_mm"] = sensor.baseline_mm;
  scene.info["foreign"] = foreign;
  scene.info["bin_inner_mm"] = {bin.length_mm, bin.width_mm, bin.height_mm};
  scene.info["wall_mm"] = bin.wall_mm;
  scene.info["max_overlap_mm"] = fill.max_overlap_mm;
  scene.info["drift_mm"] = fill.drift_mm;
  return scene;
}

}  // namespace tribin::sim
