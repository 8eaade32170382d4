// The simulator measured against itself: heaps at rest without overlap, and pattern frames that are rendered and
// decoded against the fast mode of the same bins: measured pixels, sd and correlation of the depth error, time on one
// core. usage: campaign_simulator [SCENES] [CAD...]     (of each level, default 6, of both alternators)

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "sim/drawn_scene.hpp"
#include "tribin/capture/triangulate.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/sim/render_frames.hpp"

namespace {

using namespace tribin;
using namespace tribin::sim;

double seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Measured pixels; sd in units of the noise law and correlation with the right neighbour, of errors up to 6 sd.
struct Noise {
  double valid = 0, sd = 0, correlation = 0;
};

Noise noise_of(const Scan& scan, const SimulatedScan& truth) {
  Noise noise;
  double squares = 0, products = 0, n = 0;
  const auto error = [&](int u, int v) { return (scan.z_mm(u, v) - truth.true_z(u, v)) / truth.sigma_mm(u, v); };
  for (int v = 0; v < scan.height(); ++v)
    for (int u = 0; u < scan.width(); ++u) {
      noise.valid += std::isfinite(scan.z_mm(u, v));
      if (u + 1 == scan.width() || truth.body(u, v) != truth.body(u + 1, v)) continue;
      const double a = error(u, v), b = error(u + 1, v);
      if (!(std::abs(a) < 6 && std::abs(b) < 6)) continue;
      squares += a * a, products += a * b, ++n;
    }
  noise.sd = std::sqrt(squares / n);
  noise.correlation = products / squares;
  return noise;
}

struct Worst {
  double valid = 0, sd = 0, correlation = 0, overlap = 0, drift = 0, time = 0;
};

void run_scene(const SceneStock& stock, const LevelSettings& level, std::uint64_t seed, Worst& worst) {
  const double start = seconds();
  DrawnScene scene = draw_bin_scene(stock, SceneKind::bin, level, seed);
  // Neither is a matter of light: the calibration's error, and pixels lost for no reason that is modelled.
  scene.sensor.systematic = scene.sensor.lost_share = 0;
  const double filled = seconds();
  const SimulatedScan fast = simulate_scan(scene.bodies, scene.sensor, seed);
  const double scanned = seconds();
  RenderOptions render;
  PatternOptions patterns;
  patterns.width = render.projector_width;
  patterns.height = render.projector_height;
  render.patterns = make_patterns(patterns);
  const Decoded decoded = decode(render_frames(scene.bodies, scene.sensor, render, seed));
  const Scan rendered = triangulate(rig_of(scene.sensor, render), decoded).scan;
  const Noise a = noise_of(fast.scan, fast), b = noise_of(rendered, fast);
  const double overlap = scene.info["max_overlap_mm"], drift = scene.info["drift_mm"];
  std::printf("%-6s %4d %6.2f %6.2f %8.3f %7.3f %+9.2f %+7.2f %+7.2f\n", level.name, static_cast<int>(seed),
              filled - start, scanned - filled, overlap, drift, 100 * (b.valid / a.valid - 1), 100 * (b.sd / a.sd - 1),
              100 * (b.correlation / a.correlation - 1));
  std::fflush(stdout);
  const auto note = [](double& w, double x) { w = std::max(w, std::abs(x)); };
  note(worst.valid, b.valid / a.valid - 1);
  note(worst.sd, b.sd / a.sd - 1);
  note(worst.correlation, b.correlation / a.correlation - 1);
  note(worst.overlap, overlap);
  note(worst.drift, drift);
  note(worst.time, scanned - start);
}

int run(int scenes, const std::vector<std::string>& files) {
  std::vector<Mesh> parts;
  for (const std::string& file : files) parts.push_back(read_cad(file));
  set_thread_count(1);
  Worst worst;
  std::printf("level  seed fill s scan s overlap   drift   valid %%    sd %%  corr %%   (rendered against fast)\n");
  for (const Level l : {Level::easy, Level::dense, Level::hard}) {
    const LevelSettings& level = settings_of(l);
    const SceneStock stock = make_stock(parts, SceneKind::bin, level);
    for (int seed = 1; seed <= scenes; ++seed) run_scene(stock, level, static_cast<std::uint64_t>(seed), worst);
  }
  std::printf("worst: overlap %.3f mm, drift %.3f mm, valid %.2f %%, sd %.2f %%, correlation %.2f %%, time %.1f s\n",
              worst.overlap, worst.drift, 100 * worst.valid, 100 * worst.sd, 100 * worst.correlation, worst.time);
  const bool good =
      worst.overlap <= 0.5 && worst.drift == 0 && worst.valid <= 0.02 && worst.sd <= 0.1 && worst.correlation <= 0.1;
  std::printf("%s: wanted overlap <= 0.5 mm, all at rest, valid within 2 %%, sd and correlation within 10 %%\n",
              good ? "PASSED" : "FAILED");
  return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> files(argv + std::min(argc, 2), argv + argc);
  if (files.empty()) files = {"examples/parts/alternator_a.stl", "examples/parts/alternator_b.stl"};
  try {
    return run(argc > 1 ? std::atoi(argv[1]) : 6, files);
  } catch (const tribin::Error& e) {
    std::printf("%s\n", e.what());
    return static_cast<int>(e.code());
  }
}
