#include "tribin/sim/table_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "io/atomic_file.hpp"
#include "sim/random.hpp"
#include "tribin/core/error.hpp"
#include "tribin/sim/bop_writer.hpp"
#include "tribin/sim/table_scene.hpp"

namespace tribin::sim {
namespace {

struct LevelSettings {
  const char* name;
  int fewest, most;  ///< parts
  int most_classes;
  double image_noise, correlation_px, systematic, highlight, max_tilt, lost_low, lost_high;
};

// The contract's section 8; the same for table and bin.
constexpr LevelSettings kLevels[] = {
    {"easy", 3, 10, 2, 1.5, 0.5, 0.0002, 0.5, 4 * kDegree, 0, 0},
    {"dense", 12, 25, 3, 2.0, 0.8, 0.0005, 1.0, 8 * kDegree, 0, 0},
    {"hard", 20, 40, 3, 3.0, 1.0, 0.0010, 1.0, 15 * kDegree, 0.10, 0.25},
};

constexpr double kTableAlbedo = 0.2;  // a dark work bench: 2.5 times the noise of a bright part
constexpr double kShareOfView =
    0.9;  // of the table's view in which parts may lie: tall ones reach outwards in the image

/// Which parts lie in a scene: indices, drawn from at most `most_classes` classes.
std::vector<int> drawn_parts(const LevelSettings& level, int classes, Random& random) {
  std::vector<int> order(classes);
  for (int i = 0; i < classes; ++i) order[i] = i;
  for (int i = classes - 1; i > 0; --i) std::swap(order[i], order[random.integer(0, i)]);
  order.resize(random.integer(1, std::min(classes, level.most_classes)));
  std::vector<int> drawn(random.integer(level.fewest, level.most));
  for (int& part : drawn) part = order[random.integer(0, static_cast<int>(order.size()) - 1)];
  return drawn;
}

/// Distance at which the parts' bounding circles take about half of the view.
double camera_distance(const std::vector<TablePart>& parts, const PinholeCamera& camera) {
  double area = 0;
  for (const TablePart& p : parts) area += std::pow(2 * radius_from_above(*p.mesh, p.rests->front()), 2);
  const double view = camera.width / camera.fx * camera.height / camera.fy;  // of the table at 1 mm
  // 560 mm: the nearest at which a sensor of 180 mm baseline is focused; 1,500 mm: 16 bit and noise end there.
  return std::clamp(std::sqrt(2 * area / view), 560.0, 1500.0);
}

void check(const TableDatasetOptions& options) {
  if (options.parts.empty())
    throw Error(ErrorCode::bad_option, "simulate: no part given; wanted --part CAD at least once");
  if (options.scenes < 1)
    throw Error(ErrorCode::bad_option,
                "simulate: --scenes is " + std::to_string(options.scenes) + "; wanted 1 or more");
  std::set<std::string> names;
  for (const Mesh& part : options.parts)
    if (!names.insert(part.name).second)
      throw Error(ErrorCode::bad_option, "simulate: two parts are called " + part.name);
}

}  // namespace

Level level_of(const std::string& name) {
  for (int i = 0; i < 3; ++i)
    if (name == kLevels[i].name) return static_cast<Level>(i);
  throw Error(ErrorCode::bad_option, "--level is \"" + name + "\"; wanted easy, dense or hard");
}

void simulate_table_dataset(const TableDatasetOptions& options, const std::filesystem::path& directory) {
  check(options);
  const LevelSettings& level = kLevels[static_cast<int>(options.level)];
  const int classes = static_cast<int>(options.parts.size());
  std::vector<std::vector<StableRest>> rests;
  for (const Mesh& part : options.parts) rests.push_back(stable_rests(part));
  const Mesh table = table_mesh();
  nlohmann::ordered_json scene_info, targets = nlohmann::ordered_json::array();

  for (int scene = 1; scene <= options.scenes; ++scene) {
    const std::uint64_t seed = mixed(options.seed * 1000003u + static_cast<std::uint64_t>(scene));
    Random random(seed);
    const std::vector<int> drawn = drawn_parts(level, classes, random);
    std::vector<TablePart> parts;
    for (const int k : drawn) parts.push_back({&options.parts[k], &rests[k]});

    StructuredLight sensor;
    sensor.image_noise = level.image_noise;
    sensor.noise_correlation_px = level.correlation_px;
    sensor.systematic = level.systematic;
    sensor.highlight = level.highlight;
    sensor.lost_share = level.lost_high > 0 ? random.uniform(level.lost_low, level.lost_high) : 0;
    sensor.reference_mm = camera_distance(parts, sensor.camera);
    const Pose camera_from_table =
        camera_above(sensor.reference_mm, random.uniform(0, level.max_tilt), random.uniform(0, 2 * kPi));
    const double half = 0.5 * kShareOfView * sensor.reference_mm;
    const Layout layout = lay_on_table(parts, half * sensor.camera.width / sensor.camera.fx,
                                       half * sensor.camera.height / sensor.camera.fy, random.bits());

    std::vector<Body> bodies = {{&table, camera_from_table, kTableAlbedo, /*shine=*/0}};
    BopImage image{nullptr, camera_from_table, {0}};
    std::vector<int> counts(classes, 0);
    std::vector<double> albedo(classes);  // one class, one finish: from painted dark to bright cast metal
    for (double& a : albedo) a = random.uniform(0.2, 0.6);
    for (std::size_t i = 0; i < layout.laid.size(); ++i) {
      const int k = drawn[layout.laid[i]];
      bodies.push_back({&options.parts[k], camera_from_table * layout.table_from_part[i], albedo[k], 1});
      image.object_of_body.push_back(k + 1);
      ++counts[k];
    }
    const SimulatedScan simulated = simulate_scan(bodies, sensor, seed);
    image.simulated = &simulated;
    // The table's far corner under the largest tilt of any level is within 1.25 of the distance.
    const double depth_scale = depth_scale_for(1.25 * sensor.reference_mm);
    if (scene == 1) write_bop_models(directory, options.parts, sensor.camera, depth_scale);
    write_bop_scene(directory, scene, image, classes, depth_scale);
    for (int k = 0; k < classes; ++k)
      if (counts[k] > 0)
        targets.push_back({{"im_id", 0}, {"inst_count", counts[k]}, {"obj_id", k + 1}, {"scene_id", scene}});
    scene_info[std::to_string(scene)] = {
        {"kind", "table"},
        {"level", level.name},
        {"seed", options.seed},
        {"objects", layout.laid.size()},
        {"sigma_i", sensor.image_noise},
        {"noise_correlation_px", sensor.noise_correlation_px},
        {"systematic", sensor.systematic},
        {"lost", sensor.lost_share},
        {"distance_mm", sensor.reference_mm},
        {"valid", static_cast<double>(valid_count(simulated.scan)) / simulated.scan.z_mm.size()}};
    if (options.progress) options.progress(scene, options.scenes);
  }
  io::write_file(directory / "scene_info.json", scene_info.dump(1) + "\n");
  io::write_file(directory / "test_targets_bop19.json", targets.dump(1) + "\n");
}

}  // namespace tribin::sim
