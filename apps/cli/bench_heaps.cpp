#include "bench_heaps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "output.hpp"
#include "peer_process.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/eval/bop_dataset.hpp"
#include "tribin/eval/figures.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/part_cache.hpp"
#include "tribin/io/scan_files.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/surfel/pixel_normals.hpp"

namespace tribin::cli {
namespace {

namespace fs = std::filesystem;

struct PosePeer {
  const char *name, *program, *package;
};
constexpr PosePeer kPeers[] = {
    {"Open3D FPFH + RANSAC + ICP, in a loop", "open3d_poses", "libopen3d-dev"},
    {"OpenCV surface_matching (PPF + ICP)", "opencv_poses", "libopencv-contrib-dev"},
};

/// The parts of a data set, as ours and as the peers get them.
struct Stock {
  std::vector<eval::BopObject> objects;
  std::vector<eval::Model> models;
  std::vector<Part> parts;
  std::vector<fs::path> points;  ///< float32 x y z nx ny nz
};

/// Points on the surface with the normals of their facets, as peers read them.
std::vector<float> oriented_points(const Mesh& mesh) {
  constexpr int kPoints = 20000;  // 1 % of the diameter apart
  std::vector<Vec3f> normals;
  const std::vector<Vec3f> points = eval::points_on(mesh, kPoints, &normals);
  std::vector<float> out;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const Vec3f& v : {points[i], normals[i]}) out.insert(out.end(), {v[0], v[1], v[2]});
  return out;
}

Stock stock_of(const fs::path& dataset, const fs::path& scratch) {
  Stock stock{eval::list_bop_objects(dataset / "models"), eval::read_bop_models(dataset / "models"), {}, {}};
  for (const eval::BopObject& object : stock.objects) {
    PartReadOptions options;
    options.name = object.name;
    options.cache = part_cache_folder();
    stock.parts.push_back(read_part(object.file, options));
    declare_symmetry(stock.parts.back(), object.symmetry);
    stock.points.push_back(scratch / ("model_" + std::to_string(object.id)));
    peer::write_raw(stock.points.back().string(), oriented_points(stock.parts.back().mesh));
  }
  return stock;
}

/// The cloud of the parts alone, with normals towards the camera.
void write_cloud(const Scan& scan, const fs::path& scene, const fs::path& path) {
  const Scan labels = read_scan(scene / "truth/label.png", {.camera_file = scene / "scene_camera.json", .image_id = 0});
  const Image<Vec3f> normals = pixel_normals(scan);
  std::vector<float> values;
  for (int v = 0; v < scan.height(); ++v)
    for (int u = 0; u < scan.width(); ++u) {
      const bool wanted = scan.z_mm(u, v) > 0 && labels.z_mm(u, v) > 0;
      const Vec3 p = wanted ? scan.point(u, v) : Vec3(Vec3::Constant(std::nan("")));
      for (int i = 0; i < 3; ++i) values.push_back(static_cast<float>(p[i]));
      for (int i = 0; i < 3; ++i) values.push_back(wanted ? normals(u, v)[i] : 0);
    }
  peer::write_raw(path.string(), values);
}

eval::ImageResult ours(const Scan& scan, const Stock& stock, const eval::BopTask& task) {
  std::vector<Part> parts;
  for (std::size_t k = 0; k < stock.objects.size(); ++k)
    if (std::binary_search(task.objects.begin(), task.objects.end(), stock.objects[k].id))
      parts.push_back(stock.parts[k]);
  const double before = cpu_ms();
  const Found found = find_parts(scan, parts);
  eval::ImageResult out;
  out.seconds = (cpu_ms() - before) / 1000;
  out.instances = found.instances.items;
  return out;
}

constexpr int kMostSeconds = 200;  // for one scene, training included: a cell waits for one or two

/// Nothing where the peer failed, or took too long.
std::optional<eval::ImageResult> of_peer(const PosePeer& peer, const Scan& scan, const Stock& stock,
                                         const eval::BopTask& task, const fs::path& cloud) {
  std::vector<fs::path> files;
  std::vector<std::string> names;
  for (std::size_t k = 0; k < stock.objects.size(); ++k)
    if (std::binary_search(task.objects.begin(), task.objects.end(), stock.objects[k].id)) {
      files.push_back(stock.points[k]);
      names.push_back(stock.objects[k].name);
    }
  const fs::path answer = cloud.parent_path() / "poses";
  const auto times = run_peer(peer_folder() / peer.program, cloud, answer, scan.camera, files, kMostSeconds);
  if (!times.count("ms")) return std::nullopt;
  eval::ImageResult out;
  out.seconds = times.at("ms") / 1000;
  for (const peer::PeerPose& pose : peer::read_poses(answer.string())) {
    Instance instance;
    instance.part = names.at(static_cast<std::size_t>(pose.model));
    instance.score = pose.score;
    for (int i = 0; i < 9; ++i) instance.camera_from_part.linear()(i / 3, i % 3) = pose.rotation[i];
    for (int i = 0; i < 3; ++i) instance.camera_from_part.translation()[i] = pose.translation_mm[i];
    out.instances.push_back(instance);
  }
  return out;
}

std::string row(const char* name, const std::vector<eval::ImageTruth>& truths, std::vector<eval::ImageResult> results,
                const Stock& stock) {
  const eval::Judged judged = eval::judge_results(truths, results, stock.models);
  const eval::Figures f = eval::all_figures(judged).front();
  char text[240];
  std::snprintf(text, sizeof text, "  %-40s %3d/%-3d (%.2f-%.2f)  %3d/%-3d (%.2f-%.2f)  %7.3f  %7.3f  %8.2f\n", name,
                f.recall_40.count, f.recall_40.of, f.recall_40.low, f.recall_40.high, f.false_share.count,
                f.false_share.of, f.false_share.low, f.false_share.high, f.median_mm.value, f.median_deg.value,
                eval::quantile(judged.seconds, 0.5));
  return text;
}

}  // namespace

std::string compare_heaps(const fs::path& dataset, int scenes) {
  const fs::path targets = dataset / "test_targets_bop19.json";
  const int threads = thread_count();
  set_thread_count(1);  // as the peers
  StagedOutput scratch(fs::temp_directory_path() / "tribin_heaps");
  fs::create_directories(scratch.path());
  const Stock stock = stock_of(dataset, scratch.path());
  std::vector<eval::BopTask> tasks = eval::list_bop_tasks(dataset, "test", targets, stock.objects);
  std::vector<eval::ImageTruth> truths = eval::read_truths(dataset, "test", targets, dataset / "models");
  const std::size_t count = std::min(tasks.size(), static_cast<std::size_t>(scenes));
  tasks.resize(count), truths.resize(count);

  constexpr std::size_t kMethods = 1 + std::size(kPeers);
  std::vector<eval::ImageResult> results[kMethods];
  int unfinished[kMethods] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const Scan scan = read_scan(tasks[i].depth, {.camera_file = tasks[i].camera, .image_id = tasks[i].image});
    const fs::path cloud = scratch.path() / "cloud";
    write_cloud(scan, tasks[i].camera.parent_path(), cloud);
    for (std::size_t m = 0; m < kMethods; ++m) {
      if (m > 0 && !fs::exists(peer_folder() / kPeers[m - 1].program)) continue;
      std::optional<eval::ImageResult> result =
          m == 0 ? ours(scan, stock, tasks[i]) : of_peer(kPeers[m - 1], scan, stock, tasks[i], cloud);
      if (!result) {  // nothing found, and nothing false
        ++unfinished[m];
        result.emplace();
        result->seconds = kMostSeconds;
      }
      result->scene = tasks[i].scene, result->image = tasks[i].image;
      results[m].push_back(std::move(*result));
    }
  }
  set_thread_count(threads);
  std::string out = "Heaps: " + std::to_string(count) + " scenes of " + dataset.string() +
                    ", one thread each; 95 % intervals in brackets, CPU time\n  " + std::string(40, ' ') +
                    "  found >= 40 %       false of given    median mm      deg  median s\n";
  for (std::size_t m = 0; m < kMethods; ++m) {
    const char* name = m == 0 ? "tribin, with background" : kPeers[m - 1].name;
    if (results[m].size() < count) {
      out += std::string("  ") + name + ": not built (install " + kPeers[m - 1].package +
             ", configure with -DTRIBIN_PEERS=ON)\n";
      continue;
    }
    out += row(name, truths, results[m], stock);
    if (unfinished[m] > 0)
      out += std::string(42, ' ') + std::to_string(unfinished[m]) + " scenes not done in " +
             std::to_string(kMostSeconds) + " s with training: nothing found there\n";
  }
  return out;
}

}  // namespace tribin::cli
