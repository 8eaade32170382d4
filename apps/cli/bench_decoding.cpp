#ifdef TRIBIN_WITH_SIM

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "bench_peers.hpp"
#include "output.hpp"
#include "peer_process.hpp"
#include "tribin/capture/decode.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/sim/paper_experiment.hpp"

namespace tribin::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 1024, kHeight = 768;                    // of the projector
constexpr double kModulation = 60, kAmbient = 20, kNoise = 2;  // [grey levels]

/// Where each pixel of a scan looks on a projector that stands 150 mm to the right of the camera and is turned to the
/// middle of the scene; NaN = dark.
std::vector<float> projected(const Scan& scan) {
  const double distance = 800, aside = 150, turn = std::atan2(aside, distance), focal = 1.1 * kWidth;
  std::vector<float> out;
  out.reserve(2 * scan.z_mm.size());
  for (int v = 0; v < scan.height(); ++v)
    for (int u = 0; u < scan.width(); ++u) {
      Vec2 pixel = Vec2::Constant(std::nan(""));
      if (scan.z_mm(u, v) > 0) {
        const Vec3 p = rotation_from_vector(Vec3(0, turn, 0)) * (scan.point(u, v) - Vec3(aside, 0, 0));
        pixel = Vec2(focal * p.x() / p.z() + 0.5 * kWidth, focal * p.y() / p.z() + 0.5 * kHeight);
        if (!(pixel.minCoeff() >= 0 && pixel.x() < kWidth - 1 && pixel.y() < kHeight - 1))
          pixel.setConstant(std::nan(""));
      }
      out.push_back(static_cast<float>(pixel.x()));
      out.push_back(static_cast<float>(pixel.y()));
    }
  return out;
}

FrameStack frames_of(const std::vector<float>& looks, int width, int height, const std::vector<Pattern>& patterns) {
  FrameStack out;
  out.camera = "simulated";
  out.patterns = patterns;
  std::mt19937_64 random(1);
  std::normal_distribution<float> normal(0, kNoise);
  std::vector<float> noise(1 << 20);
  for (float& n : noise) n = normal(random);
  for (const Pattern& p : patterns) {
    Image<std::uint8_t> image(width, height);
    const std::uint64_t shift = random() % noise.size();  // one field of noise, read from another place each time
    for (std::size_t i = 0; i < image.size(); ++i) {
      const float x = looks[2 * i + (p.axis == PatternAxis::row)];
      const double light = std::isfinite(x) ? kAmbient + 2 * kModulation * pattern_value(p, x + 0.5) : kAmbient / 4;
      image.data[i] =
          static_cast<std::uint8_t>(std::clamp(std::lround(light + noise[(i + shift) % noise.size()]), 0L, 255L));
    }
    out.grey8.push_back(std::move(image));
  }
  return out;
}

/// Share of the lit pixels whose column is told, and of those the ones that are off by more than a pixel.
struct Outcome {
  double ms = -1, told = 0, wrong = 0;
};

template <class Column>
void judge(const std::vector<float>& looks, Column column, Outcome& out) {
  std::size_t lit = 0, told = 0, wrong = 0;
  for (std::size_t i = 0; i < looks.size() / 2; ++i) {
    if (!std::isfinite(looks[2 * i])) continue;
    ++lit;
    const double x = column(i);
    if (!std::isfinite(x)) continue;
    ++told;
    wrong += std::abs(x - looks[2 * i]) > 1;
  }
  out.told = static_cast<double>(told) / static_cast<double>(std::max<std::size_t>(1, lit));
  out.wrong = static_cast<double>(wrong) / static_cast<double>(std::max<std::size_t>(1, told));
}

Outcome ours(const std::vector<float>& looks, int width, int height, const PatternOptions& options, int& images) {
  const std::vector<Pattern> patterns = make_patterns(options);
  images = static_cast<int>(patterns.size());
  const FrameStack frames = frames_of(looks, width, height, patterns);
  constexpr int kRounds = 5;
  Outcome out;
  Decoded decoded;
  for (int round = 0; round < kRounds; ++round) {
    const double before = cpu_ms();
    decoded = decode(frames);
    const double ms = cpu_ms() - before;
    out.ms = round == 0 ? ms : std::min(out.ms, ms);
  }
  judge(
      looks, [&](std::size_t i) { return decoded.column.data[i]; }, out);
  return out;
}

std::string row(const std::string& name, const Outcome& o, double megapixels, double ours_ms) {
  char text[200];
  std::snprintf(text, sizeof text, "  %-42s %9.2f ms/Mpx %6.0f x   %6.2f %%   %8.4f %%\n", name.c_str(),
                o.ms / megapixels, o.ms / ours_ms, 100 * o.told, 100 * o.wrong);
  return text;
}

}  // namespace

std::string compare_decoding(const Part& part, int seed) {
  const sim::PaperScene scene = sim::paper_scene(part.mesh, sim::stable_rests(part.mesh), seed);
  const Scan& scan = scene.scan();
  const std::vector<float> looks = projected(scan);
  const double megapixels = 1e-6 * static_cast<double>(scan.z_mm.size());
  const int threads = thread_count();
  set_thread_count(1);  // as the peer
  std::string out =
      "Decoding, projector of 1024 x 768                        time             ratio     told    wrong by > 1 px\n";
  double first = 0;
  const PatternOptions base{.width = kWidth, .height = kHeight};
  struct Set {
    const char* name;
    PatternOptions options;
  };
  PatternOptions both = base, beats = base, micro = base;
  both.rows = true;
  beats.code = PatternCode::heterodyne;
  micro.code = PatternCode::micro;
  for (const auto& [name, options] : {Set{"Gray + phase, columns", base}, Set{"Gray + phase, columns and rows", both},
                                      Set{"heterodyne, columns", beats}, Set{"micro, columns", micro}}) {
    int images = 0;
    const Outcome o = ours(looks, scan.width(), scan.height(), options, images);
    if (first == 0) first = o.ms;
    out += row("tribin, " + std::string(name) + ", " + std::to_string(images), o, megapixels, first);
  }
  const fs::path program = peer_folder() / "opencv_gray_code";
  const std::string name = "OpenCV GrayCodePattern";
  if (!fs::exists(program)) {
    out += "  " + name + ": not built (install libopencv-dev, configure with -DTRIBIN_PEERS=ON)\n";
  } else {
    StagedOutput scratch(fs::temp_directory_path() / "tribin_decoding");
    fs::create_directories(scratch.path());
    peer::write_raw((scratch.path() / "looks").string(), looks);
    PinholeCamera request{scan.width(), scan.height(), kWidth, kHeight, kModulation, kNoise};
    const auto times = run_peer(program, scratch.path() / "looks", scratch.path() / "columns", request);
    const std::vector<int> columns = peer::read_raw<int>((scratch.path() / "columns").string(), scan.z_mm.size());
    if (times.empty() || columns.empty()) {
      out += "  " + name + ": failed\n";
    } else {
      Outcome o;
      judge(
          looks, [&](std::size_t i) { return columns[i] < 0 ? std::nan("") : columns[i]; }, o);
      for (const auto& [key, ms] : times) {
        o.ms = ms;
        out += row(std::string("OpenCV GrayCodePattern, 42, ") + (key == "ms" ? "getProjPixel" : "decode()"), o,
                   megapixels, first);
      }
    }
  }
  set_thread_count(threads);
  return out;
}

}  // namespace tribin::cli

#endif
