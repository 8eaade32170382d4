#include "tribin/sim/dataset.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "io/atomic_file.hpp"
#include "sim/drawn_scene.hpp"
#include "sim/frames_of_scene.hpp"
#include "sim/random.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/sim/bop_writer.hpp"
#include "tribin/sim/paper_experiment.hpp"

namespace tribin::sim {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kKinds[] = {"table", "bin", "empty", "foreign"};

void check(const DatasetOptions& options) {
  if (options.parts.empty())
    throw Error(ErrorCode::bad_option, "simulate: no part given; wanted --part CAD at least once");
  if (options.scenes < 1)
    throw Error(ErrorCode::bad_option,
                "simulate: --scenes is " + std::to_string(options.scenes) + "; wanted 1 or more");
  if (options.cell && options.kind == SceneKind::table)
    throw Error(ErrorCode::bad_option,
                "simulate: --kind table does not go with a work cell, which has a bin; wanted "
                "bin, empty or foreign");
  std::set<std::string> names;
  for (const Mesh& part : options.parts)
    if (!names.insert(part.name).second)
      throw Error(ErrorCode::bad_option, "simulate: two parts are called " + part.name);
}

std::string scene_name(int scene) {
  char name[16];
  std::snprintf(name, sizeof name, "%06d", scene);
  return name;
}

ordered_json read_json(const fs::path& path) {
  std::ifstream file(path);
  ordered_json json = ordered_json::parse(file, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded())
    throw Error(ErrorCode::bad_input, path.string() + ": cannot be read as JSON; remove the scene to make it anew");
  return json;
}

/// What makes two data sets the same: the parts by their triangles, and all that is drawn from.
ordered_json recipe_of(const DatasetOptions& options) {
  ordered_json parts = ordered_json::array();
  for (const Mesh& part : options.parts) {
    std::uint64_t hash = part.triangles.size();
    for (const Vec3f& v : part.vertices)
      for (int k = 0; k < 3; ++k) hash = mixed(hash ^ std::bit_cast<std::uint32_t>(v[k]));
    parts.push_back({{"name", part.name}, {"hash", hash}});
  }
  ordered_json recipe = {{"kind", kKinds[static_cast<int>(options.kind)]},
                         {"level", settings_of(options.level).name},
                         {"seed", options.seed},
                         {"frames", options.frames},
                         {"version", TRIBIN_VERSION},
                         {"parts", parts}};
  if (options.cell) {
    const CellView& cell = *options.cell;
    const PinholeCamera& c = cell.camera;
    const Bin& bin = cell.bin;
    ordered_json pose = ordered_json::array();
    for (int i = 0; i < 12; ++i) pose.push_back(cell.camera_from_bin.matrix()(i / 4, i % 4));
    recipe["cell"] = {{"camera", {c.width, c.height, c.fx, c.fy, c.cx, c.cy}},
                      {"noise", {cell.noise.sigma_mm, cell.noise.correlation_px}},
                      {"camera_from_bin", pose},
                      {"bin", {bin.length_mm, bin.width_mm, bin.height_mm, bin.wall_mm}}};
  }
  if (options.systematic) recipe["systematic"] = *options.systematic;
  if (options.scale_error > 0) recipe["scale_error"] = options.scale_error;
  return recipe;
}

/// Goes on with a data set of the same recipe, or starts one.
void open_dataset(const DatasetOptions& options, const fs::path& directory) {
  const fs::path parent = fs::absolute(directory).lexically_normal().parent_path();
  if (!fs::is_directory(directory.has_filename() ? parent : parent.parent_path()))
    throw Error(ErrorCode::bad_option, directory.string() + ": saw no folder in which it could be made");
  const ordered_json recipe = recipe_of(options);
  const fs::path file = directory / "dataset.json";
  if (fs::exists(file)) {
    if (read_json(file) != recipe)
      throw Error(ErrorCode::bad_option, directory.string() +
                                             " holds a data set of other parts, kind, level, seed or version; wanted "
                                             "the same, an empty folder or a new one");
    return;
  }
  if (fs::exists(directory / "test"))
    throw Error(ErrorCode::bad_option,
                directory.string() + " holds scenes without their dataset.json; wanted an empty folder or a new one");
  write_bop_models(directory, options.parts, options.cell ? options.cell->camera : StructuredLight().camera,
                   depth_scale_for(1500));
  io::write_file(file, recipe.dump(1) + "\n");
}

/// What mirrored light and a tilted camera's floor make of it may lie beyond what the scene was laid out for.
double largest_depth_mm(const SimulatedScan& simulated) {
  float largest = 0;
  for (const Image<float>* image : {&simulated.scan.z_mm, &simulated.true_z})
    for (const float z : image->data)
      if (z > largest && std::isfinite(z)) largest = z;
  return largest;
}

void write_frames_of(const DrawnScene& drawn, std::uint64_t seed, const fs::path& folder) {
  const SceneFrames taken = frames_of(drawn, seed);
  write_frames(folder, {taken.frames});
  write_rig(folder / "rig.json", taken.rig);
}

// The rms over the image of a quadratic whose coefficients are drawn in [-1, 1] and scaled to a sum of 1, as
// simulate_scan has it: E[c^2] = 0.038 each, times 1 + 2/3 + 2/5 + 1/9 for the powers of x and y.
constexpr double kShapeRms = 0.29;

/// How well the pixels of each part could tell its pose, nothing systematic counted; 0 where a direction is free.
std::vector<PoseBound> bounds_of(const SimulatedScan& simulated, const DrawnScene& drawn) {
  std::vector<PoseBound> out(simulated.bodies.size());
  for (std::size_t b = 0; b < out.size(); ++b) {
    if (drawn.object_of_body[b] == 0 || simulated.bodies[b].pixels_measured == 0) continue;
    try {
      out[b] = pose_bound(cramer_rao_bound(simulated, static_cast<int>(b), drawn.sensor.noise_correlation_px),
                          drawn.bodies[b].camera_from_body, bounding_box(drawn.bodies[b].mesh->vertices).center());
    } catch (const Error&) {
      // A part of revolution, or one that shows too little: it has no bound.
    }
  }
  return out;
}

/// Makes one scene and puts it in its place.
void make_scene(const DatasetOptions& options, const SceneStock& stock, int scene, const fs::path& directory) {
  const LevelSettings& level = settings_of(options.level);
  const std::uint64_t seed = seed_of_scene(options.seed, scene);
  DrawnScene drawn = options.kind == SceneKind::table ? draw_table_scene(stock, level, seed)
                                                      : draw_bin_scene(stock, options.kind, level, seed, options.cell);
  if (options.systematic) drawn.sensor.systematic = *options.systematic;
  if (options.scale_error > 0) drawn.sensor.scale = 1 + options.scale_error * Random(mixed(seed ^ 0x5CA1Eu)).normal();
  const SimulatedScan simulated = simulate_scan(drawn.bodies, drawn.sensor, seed);
  const auto objects = std::count_if(drawn.object_of_body.begin(), drawn.object_of_body.end(), [](int k) { return k; });
  ordered_json info = {{"kind", kKinds[static_cast<int>(options.kind)]},
                       {"level", level.name},
                       {"seed", options.seed},
                       {"objects", objects},
                       {"sigma_i", drawn.sensor.image_noise},
                       {"noise_correlation_px", drawn.sensor.noise_correlation_px},
                       {"systematic", drawn.sensor.systematic},
                       {"scale", drawn.sensor.scale},
                       {"mirror_share", drawn.sensor.mirror_share},
                       {"lost", drawn.sensor.lost_share}};
  info.update(drawn.info);
  info["valid"] = static_cast<double>(valid_count(simulated.scan)) / simulated.scan.z_mm.size();

  const fs::path unfinished = unfinished_scenes(directory) / scene_name(scene);
  fs::remove_all(unfinished);
  write_bop_scene(unfinished,
                  {&simulated, drawn.camera_from_world, drawn.object_of_body, bounds_of(simulated, drawn),
                   options.scale_error, kShapeRms * drawn.sensor.systematic},
                  static_cast<int>(options.parts.size()),
                  depth_scale_for(std::max(drawn.largest_depth_mm, largest_depth_mm(simulated))));
  if (options.frames) write_frames_of(drawn, seed, unfinished / "frames");
  io::write_file(unfinished / "scene_info.json", info.dump(1) + "\n");
  fs::rename(unfinished, directory / "test" / scene_name(scene));
}

/// The lists of a data set, from what its scenes say themselves.
void write_lists(const DatasetOptions& options, const fs::path& directory) {
  ordered_json infos, targets = ordered_json::array();
  for (int scene = 1; scene <= options.scenes; ++scene) {
    const fs::path folder = directory / "test" / scene_name(scene);
    infos[std::to_string(scene)] = read_json(folder / "scene_info.json");
    std::vector<int> counts(options.parts.size() + 1, 0);
    const ordered_json truth = read_json(folder / "scene_gt.json");
    for (const ordered_json& instance : truth.at("0")) ++counts.at(instance.at("obj_id").get<std::size_t>());
    for (std::size_t k = 1; k < counts.size(); ++k)
      if (counts[k] > 0)
        targets.push_back({{"im_id", 0}, {"inst_count", counts[k]}, {"obj_id", k}, {"scene_id", scene}});
  }
  io::write_file(directory / "scene_info.json", infos.dump(1) + "\n");
  io::write_file(directory / "test_targets_bop19.json", targets.dump(1) + "\n");
}

}  // namespace

SceneKind scene_kind_of(const std::string& name) {
  for (std::size_t i = 0; i < std::size(kKinds); ++i)
    if (name == kKinds[i]) return static_cast<SceneKind>(i);
  throw Error(ErrorCode::bad_option, "--kind is \"" + name + "\"; wanted table, bin, empty or foreign");
}

fs::path unfinished_scenes(const fs::path& directory) { return directory / ".unfinished"; }

void simulate_dataset(const DatasetOptions& options, const fs::path& directory) {
  check(options);
  open_dataset(options, directory);
  std::vector<int> missing;
  for (int scene = 1; scene <= options.scenes; ++scene)
    if (!fs::exists(directory / "test" / scene_name(scene))) missing.push_back(scene);
  if (!missing.empty()) {
    const SceneStock stock = make_stock(options.parts, options.kind, settings_of(options.level));
    fs::create_directories(directory / "test");
    std::mutex mutex;
    int done = options.scenes - static_cast<int>(missing.size());
    std::exception_ptr failure;
    parallel_each(static_cast<int>(missing.size()), [&](int i) {
      {
        const std::lock_guard lock(mutex);
        if (failure) return;  // the others stay as they are: the next run goes on
      }
      try {
        make_scene(options, stock, missing[i], directory);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        return;
      }
      const std::lock_guard lock(mutex);
      ++done;
      if (options.progress) options.progress(done, options.scenes);
    });
    fs::remove_all(unfinished_scenes(directory));
    if (failure) std::rethrow_exception(failure);
  }
  write_lists(options, directory);
}

}  // namespace tribin::sim
