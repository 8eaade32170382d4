#include "bench_peers.hpp"

#ifdef TRIBIN_WITH_SIM

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>

#include "output.hpp"
#include "peer_process.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/eval/eval.hpp"
#include "tribin/segmentation/primitives.hpp"
#include "tribin/sim/paper_experiment.hpp"
#include "tribin/surfel/pixel_normals.hpp"

namespace tribin::cli {
namespace {

namespace fs = std::filesystem;

enum class Task { normals, segmentation };

struct Peer {
  const char *name, *program, *package;
  Task task;
};

constexpr Peer kPeers[] = {
    {"OpenCV RgbdNormals FALS, 7 px", "opencv_normals", "libopencv-dev", Task::normals},
    {"PCL integral images, AVERAGE_3D_GRADIENT", "pcl_normals", "libpcl-dev", Task::normals},
    {"CGAL Efficient RANSAC", "cgal_ransac", "libcgal-dev", Task::segmentation},
};

/// What one method made of one scene. Normals: median and rms angle [deg]. Segmentation: mean Dice over the true
/// primitives and share of right types.
struct Score {
  double ms = 0, first = 0, second = 0;
};

/// A label per pixel (0 = none), and which labels are cylinders.
struct Labels {
  std::vector<int> of_pixel;
  std::map<int, PrimitiveType> type;
};

/// The scene as the peers get it, and what is true in it.
struct Scene {
  sim::PaperScene paper;
  Labels truth;  ///< primitives of the part, by CAD face
};

Labels true_labels(const sim::PaperScene& scene, const Part& part) {
  std::map<std::int32_t, std::map<int, int>> votes;  // CAD face -> primitive -> triangles
  for (std::size_t t = 0; t < part.primitive_of_triangle.size(); ++t)
    ++votes[part.mesh.face_of_triangle.empty() ? static_cast<std::int32_t>(t) + 1 : part.mesh.face_of_triangle[t]]
           [part.primitive_of_triangle[t]];
  std::map<std::int32_t, int> primitive_of_face;
  for (const auto& [face, counts] : votes)
    primitive_of_face[face] = std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
                                return a.second < b.second;
                              })->first;
  const sim::SimulatedScan& s = scene.simulated;
  Labels out;
  out.of_pixel.assign(s.body.size(), 0);
  for (int v = 0; v < s.body.height; ++v)
    for (int u = 0; u < s.body.width; ++u)
      if (s.body(u, v) == 1 && scene.scan().z_mm(u, v) > 0)
        out.of_pixel[s.body.index(u, v)] = primitive_of_face[s.face(u, v)];
  for (const Primitive& p : part.model.primitives) out.type[p.id] = p.type;
  return out;
}

/// \source the rule of the Fit4CAD benchmark: each true primitive against the predicted one that shares most points.
Score score_labels(const Labels& truth, const Labels& predicted) {
  constexpr int kLeast = 1500;  // pixels that a true primitive must show
  std::map<int, int> size, predicted_size;
  std::map<int, std::map<int, int>> common;
  for (std::size_t i = 0; i < truth.of_pixel.size(); ++i) {
    if (predicted.of_pixel[i] > 0) ++predicted_size[predicted.of_pixel[i]];
    if (truth.of_pixel[i] == 0) continue;
    ++size[truth.of_pixel[i]];
    if (predicted.of_pixel[i] > 0) ++common[truth.of_pixel[i]][predicted.of_pixel[i]];
  }
  double dice = 0, right = 0;
  int count = 0;
  for (const auto& [id, pixels] : size) {
    if (pixels < kLeast) continue;
    ++count;
    const auto& c = common[id];
    const auto most = std::max_element(c.begin(), c.end(), [](auto& a, auto& b) { return a.second < b.second; });
    if (most == c.end()) continue;
    dice += 2.0 * most->second / (pixels + predicted_size[most->first]);
    right += predicted.type.at(most->first) == truth.type.at(id);
  }
  return {0, dice / std::max(1, count), right / std::max(1, count)};
}

/// \param normals  x, y, z a pixel, zero where there is none; either sense.
Score score_normals(const sim::SimulatedScan& truth, const std::vector<float>& normals) {
  std::vector<double> angles;
  double squares = 0;
  for (std::size_t i = 0; i < truth.body.size(); ++i) {
    const Vec3f n(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    if (!(truth.scan.z_mm.data[i] > 0) || truth.body.data[i] < 0 || n.isZero()) continue;
    const double c = std::abs(n.normalized().dot(truth.normal.data[i]));
    angles.push_back(std::acos(std::min(1.0, c)) / kDegree);
    squares += angles.back() * angles.back();
  }
  return {0, eval::quantile(angles, 0.5),
          std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, angles.size())))};
}

/// The cloud of a task: all points for normals; those of the part with their true normals for segmentation.
void write_cloud(const Scene& scene, Task task, const fs::path& path) {
  const sim::SimulatedScan& s = scene.paper.simulated;
  std::vector<float> values;
  for (int v = 0; v < s.body.height; ++v)
    for (int u = 0; u < s.body.width; ++u) {
      const bool wanted = s.scan.z_mm(u, v) > 0 && (task == Task::normals || s.body(u, v) == 1);
      const Vec3 p = wanted ? s.scan.point(u, v) : Vec3(Vec3::Constant(std::nan("")));
      for (int i = 0; i < 3; ++i) values.push_back(static_cast<float>(p[i]));
      for (int i = 0; i < 3 && task == Task::segmentation; ++i) values.push_back(s.normal(u, v)[i]);
    }
  peer::write_raw(path.string(), values);
}

Score ours(const Scene& scene, Task task) {
  const Scan& scan = scene.paper.scan();
  const double before = cpu_ms();
  double ms = 0;
  Score score;
  if (task == Task::normals) {
    const Image<Vec3f> normals = pixel_normals(scan);
    ms = cpu_ms() - before;
    std::vector<float> flat;
    for (const Vec3f& n : normals.data) flat.insert(flat.end(), {n[0], n[1], n[2]});
    score = score_normals(scene.paper.simulated, flat);
  } else {
    Labels labels;
    const Surfels surfels = surfels_from_scan(scan);
    const Primitives primitives = segment(surfels);
    ms = cpu_ms() - before;
    for (const std::uint16_t id : label_pixels(primitives, surfels).data) labels.of_pixel.push_back(id);
    for (const Primitive& p : primitives.items) labels.type[p.id] = p.type;
    score = score_labels(scene.truth, labels);
  }
  score.ms = ms;
  return score;
}

Score of_peer(const Scene& scene, Task task, double ms, const fs::path& out) {
  const std::size_t pixels = scene.paper.simulated.body.size();
  Score score;
  if (task == Task::normals) {
    const std::vector<float> normals = peer::read_raw<float>(out, 3 * pixels);
    if (normals.empty()) return {-1, 0, 0};
    score = score_normals(scene.paper.simulated, normals);
  } else {
    Labels labels;
    labels.of_pixel = peer::read_raw<int>(out, pixels);
    if (labels.of_pixel.empty()) return {-1, 0, 0};
    for (int& id : labels.of_pixel) {
      const bool cylinder = id & peer::kCylinderBit;
      id &= ~peer::kCylinderBit;
      if (id > 0) labels.type[id] = cylinder ? PrimitiveType::cylinder : PrimitiveType::plane;
    }
    score = score_labels(scene.truth, labels);
  }
  score.ms = ms;
  return score;
}

/// Means over the scenes.
Score mean(const std::vector<Score>& scores) {
  Score m;
  for (const Score& s : scores) {
    m.ms += s.ms / static_cast<double>(scores.size());
    m.first += s.first / static_cast<double>(scores.size());
    m.second += s.second / static_cast<double>(scores.size());
  }
  return m;
}

std::string row(const std::string& name, Task task, const Score& s, double our_ms) {
  char text[200];
  const char* format = task == Task::normals ? "  %-42s %9.1f ms %7.2f x   %6.2f deg %8.2f deg\n"
                                             : "  %-42s %9.1f ms %7.2f x   %6.3f     %6.1f %%\n";
  std::snprintf(text, sizeof text, format, name.c_str(), s.ms, s.ms / our_ms, s.first,
                task == Task::normals ? s.second : 100 * s.second);
  return text;
}

}  // namespace

std::string compare_with_peers(const std::vector<Part>& parts, int first_seed, int scenes) {
  std::vector<Scene> all;
  for (const Part& part : parts) {
    const std::vector<sim::StableRest> rests = sim::stable_rests(part.mesh);
    for (int k = 0; k < scenes; ++k) {
      Scene scene{sim::paper_scene(part.mesh, rests, first_seed + k), {}};
      scene.truth = true_labels(scene.paper, part);
      all.push_back(std::move(scene));
    }
  }
  const int threads = thread_count();
  set_thread_count(1);  // as the peers
  const fs::path folder = peer_folder();
  StagedOutput scratch(fs::temp_directory_path() / "tribin_peers");
  fs::create_directories(scratch.path());
  std::string out = "Peers: the same " + std::to_string(all.size()) +
                    " scans of 1280 x 1024, one thread each; CPU time, as a multiple of ours\n";
  for (const Task task : {Task::normals, Task::segmentation}) {
    out += task == Task::normals
               ? "Normals of all points                                  time    ratio   median        rms\n"
               : "Planes and cylinders (>= 1500 px)                      time    ratio    Dice    types right\n";
    std::vector<Score> own;
    for (const Scene& scene : all) own.push_back(ours(scene, task));
    const double our_ms = mean(own).ms;
    out += row(task == Task::normals ? "tribin, inverse depth" : "tribin, with normals and background", task, mean(own),
               our_ms);
    for (const Peer& peer : kPeers) {
      if (peer.task != task) continue;
      if (!fs::exists(folder / peer.program)) {
        out += std::string("  ") + peer.name + ": not built (install " + peer.package +
               ", configure with -DTRIBIN_PEERS=ON)\n";
        continue;
      }
      std::vector<Score> scores;
      for (const Scene& scene : all) {
        const fs::path cloud = scratch.path() / "cloud", result = scratch.path() / "result";
        write_cloud(scene, task, cloud);
        const auto times = run_peer(folder / peer.program, cloud, result, scene.paper.scan().camera);
        if (!times.count("ms")) break;
        scores.push_back(of_peer(scene, task, times.at("ms"), result));
      }
      out += scores.size() == all.size() ? row(peer.name, task, mean(scores), our_ms)
                                         : std::string("  ") + peer.name + ": failed\n";
    }
  }
  set_thread_count(threads);
  return out;
}

}  // namespace tribin::cli

#endif
