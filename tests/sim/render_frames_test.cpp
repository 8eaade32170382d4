#include "tribin/sim/render_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "sim/surface_light.hpp"
#include "tribin/capture/triangulate.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/sim/bin_scene.hpp"
#include "tribin/sim/stable_rests.hpp"
#include "tribin/sim/table_scene.hpp"

namespace tribin::sim {
namespace {

StructuredLight small_sensor() {
  StructuredLight sensor;
  sensor.camera = {320, 256, 1800, 1800, 159.5, 127.5};  // the middle of the default camera's image
  sensor.systematic = 0;
  return sensor;
}

RenderOptions with_patterns(PatternCode code, double period_px = 16) {
  RenderOptions options;
  PatternOptions patterns;
  patterns.code = code;
  patterns.period_px = period_px;
  patterns.width = options.projector_width;
  patterns.height = options.projector_height;
  options.patterns = make_patterns(patterns);
  return options;
}

Scan scan_of(const std::vector<Body>& bodies, const StructuredLight& sensor, const RenderOptions& options,
             std::uint64_t seed) {
  const Decoded decoded = decode(render_frames(bodies, sensor, options, seed));
  return triangulate(rig_of(sensor, options), decoded).scan;
}

/// sd of the depth error in units of the noise law, and its correlation with the right neighbour. Errors of more than 6
/// sd are no noise (mixed pixels, mirrored fringes) and are left out.
struct Noise {
  double sd = 0, correlation = 0;
  long valid = 0;
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

TEST(RenderedFrames, AgreeWithTheFastMode) {
  const Mesh part = read_cad(std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/parts/alternator_a.stl");
  const auto rests = stable_rests(part);
  const Mesh table = table_mesh();
  struct Case {
    double image_noise, correlation, highlight, mirror;
  };
  std::uint64_t seed = 0;
  for (const Case& c : {Case{1.5, 0.5, 0.5, 0}, Case{2, 0.8, 1, 0.15}, Case{3, 1, 1, 0.3}}) {
    SCOPED_TRACE(++seed);
    StructuredLight sensor = small_sensor();
    sensor.image_noise = c.image_noise;
    sensor.noise_correlation_px = c.correlation;
    sensor.highlight = c.highlight;
    sensor.mirror_share = c.mirror;
    const Pose view = camera_above(800, 0.1, static_cast<double>(seed));
    const std::vector<Body> bodies = {{&table, view, 0.3, 0},
                                      {&part, view * placed(rests[0], 1, -60, 20), 0.4, 1},
                                      {&part, view * placed(rests[1], 2, 60, -20), 0.4, 1}};
    const SimulatedScan fast = simulate_scan(bodies, sensor, seed);
    const Scan rendered = scan_of(bodies, sensor, with_patterns(PatternCode::gray), seed);
    const Noise a = noise_of(fast.scan, fast), b = noise_of(rendered, fast);
    EXPECT_NEAR(b.sd / a.sd, 1, 0.1);
    EXPECT_NEAR(b.correlation / a.correlation, 1, 0.1);
    EXPECT_NEAR(static_cast<double>(b.valid) / static_cast<double>(a.valid), 1, 0.02);
  }
}

TEST(RenderedFrames, AreDecodedWithoutWrongOrdersAtModulation20) {
  // A million pixels of a table at modulation 20 to 25, image noise 2: a wrong order is a fringe off.
  const Mesh table = table_mesh();
  long pixels = 0, wrong = 0;
  for (const PatternCode code : {PatternCode::gray, PatternCode::heterodyne})
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      StructuredLight sensor = small_sensor();
      sensor.image_noise = 2;
      sensor.facing_modulation = 25;
      sensor.noise_correlation_px = 0;
      const RenderOptions options = with_patterns(code);
      const std::vector<Body> bodies = {{&table, camera_above(800, 0.1, static_cast<double>(seed)), 0.5, 0}};
      const SimulatedScan truth = simulate_scan(bodies, sensor, seed);
      const Triangulated got =
          triangulate(rig_of(sensor, options), decode(render_frames(bodies, sensor, options, seed)));
      const RigCamera projector = *rig_of(sensor, options).projector;
      for (int v = 0; v < 256; ++v)
        for (int u = 0; u < 320; ++u) {
          if (!std::isfinite(got.column(u, v)) || truth.scan.modulation(u, v) < 20) continue;
          const double column = pixel_of(projector, sensor.camera.point(u, v, truth.true_z(u, v))).x();
          ++pixels;
          wrong += std::abs(got.column(u, v) - column) > 8;
        }
    }
  EXPECT_GT(pixels, 1000000);
  EXPECT_EQ(wrong, 0);
}

TEST(RenderedFrames, HighFrequenciesHalveTheErrorOfOneBounceInACorner) {
  // A bin of light plastic, one wall of which the projector meets aslant: the floor throws more light on it than it
  // gets itself, and the wide stripes of a Gray code are read wrong there. The fringes, of one period, are biased
  // alike.
  const Mesh bin = bin_mesh({200, 160, 100, 5});
  for (const double albedo : {0.7, 0.8, 0.9}) {
    SCOPED_TRACE(albedo);
    StructuredLight sensor = small_sensor();
    sensor.camera = {128, 104, 180, 180, 63.5, 51.5};
    sensor.reference_mm = 600;
    sensor.facing_modulation = 45 / albedo;  // the same exposure for each
    sensor.image_noise = 1;
    sensor.max_incidence = 89 * kDegree;  // matt plastic
    sensor.mixed_pixels = false;
    const std::vector<Body> bodies = {{&bin, camera_above(620, 0.3, 0.5), albedo, 0}};
    const SimulatedScan truth = simulate_scan(bodies, sensor, 1);
    const auto mean_error = [&](PatternCode code, int rays) {
      RenderOptions options = with_patterns(code);
      options.bounce_rays = rays;
      const Scan scan = scan_of(bodies, sensor, options, 1);
      double sum = 0, n = 0;
      for (std::size_t i = 0; i < scan.z_mm.size(); ++i)
        if (std::isfinite(scan.z_mm.data[i]) && std::isfinite(truth.scan.z_mm.data[i]))
          sum += std::abs(scan.z_mm.data[i] - truth.true_z.data[i]), ++n;
      return sum / n;
    };
    const double plain = mean_error(PatternCode::gray, 128), high = mean_error(PatternCode::heterodyne, 128);
    EXPECT_GT(plain, 2 * mean_error(PatternCode::gray, 0)) << "the bounce matters";
    EXPECT_LT(high, 0.5 * plain);
  }
}

TEST(RenderedFrames, AFolderOfThemIsAScan) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(testing::TempDir()) / "tribin_rendered_frames";
  fs::remove_all(folder);
  const Mesh table = table_mesh();
  const StructuredLight sensor = small_sensor();
  const RenderOptions options = with_patterns(PatternCode::micro);
  const std::vector<Body> bodies = {{&table, camera_above(800, 0.1, 1), 0.5, 0}};
  const FrameStack frames = render_frames(bodies, sensor, options, 5);
  write_frames(folder, {frames});
  write_rig(folder / "rig.json", rig_of(sensor, options));
  const std::vector<FrameStack> read = read_frames(folder);
  ASSERT_EQ(read.size(), 1u);
  const Scan direct = triangulate(rig_of(sensor, options), decode(frames)).scan,
             stored = triangulate(read_rig(folder / "rig.json"), decode(read[0])).scan;
  for (std::size_t i = 0; i < direct.z_mm.size(); ++i) {
    ASSERT_EQ(std::isfinite(direct.z_mm.data[i]), std::isfinite(stored.z_mm.data[i]));
    if (std::isfinite(direct.z_mm.data[i])) {
      EXPECT_NEAR(direct.z_mm.data[i], stored.z_mm.data[i], 1e-3);
    }
  }
  EXPECT_GT(valid_count(direct), 0.95 * static_cast<double>(direct.z_mm.size()));
  fs::remove_all(folder);
}

TEST(RenderedFrames, TheSameBytesForAnyNumberOfThreads) {
  const Mesh bin = bin_mesh({300, 200, 100, 5});
  StructuredLight sensor = small_sensor();
  sensor.camera = {96, 64, 150, 150, 47.5, 31.5};
  RenderOptions options = with_patterns(PatternCode::gray);
  options.bounce_rays = 16;
  const std::vector<Body> bodies = {{&bin, camera_above(800, 0.1, 1), 0.5, 1}};
  const auto bytes = [&](int threads, std::uint64_t seed) {
    set_thread_count(threads);
    std::vector<std::uint8_t> all;
    for (const auto& image : render_frames(bodies, sensor, options, seed).grey8)
      all.insert(all.end(), image.data.begin(), image.data.end());
    set_thread_count(0);
    return all;
  };
  const auto one = bytes(1, 3);
  EXPECT_EQ(one, bytes(2, 3));
  EXPECT_NE(one, bytes(2, 4));
}

TEST(RenderedFrames, RefuseWhatCannotBe) {
  RenderOptions options = with_patterns(PatternCode::gray);
  options.gamma = 0;
  EXPECT_THROW(render_frames({}, small_sensor(), options, 1), Error);
  EXPECT_THROW(render_frames({}, small_sensor(), {}, 1), Error);
}

}  // namespace
}  // namespace tribin::sim
