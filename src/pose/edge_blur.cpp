#include "tribin/pose/edge_blur.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

// Pairs of pixels steeper than this belong to a step (tan 65 deg; sensors hardly measure what they see so flat), and
// what it leads from and to is seen less steeply (tan 60 deg).
constexpr double kSteep = 2.14, kSheet = 1.73;
constexpr int kSheetPx = 4;
// Steps that tell: twenty times the noise, and high enough that a pair of a sharp one stands out from any slope.
constexpr double kNoises = 20, kPitches = 12;
constexpr std::size_t kLeast = 20;  // steps: the median of fewer is anybody's guess
constexpr int kLines = 512;         // rows, and columns, that are looked at
constexpr double kSharp = 0.5;      // [px] a step is drawn by the grid itself

/// Depth along one row or column.
struct Line {
  const SceneDepth& scene;
  bool column;
  int at;
  int size() const { return column ? scene.z_mm.height : scene.z_mm.width; }
  double focal() const { return column ? scene.camera.fy : scene.camera.fx; }
  float z(int k) const { return column ? scene.z_mm(at, k) : scene.z_mm(k, at); }
  double sigma(int k) const { return column ? scene.sigma_mm(at, k) : scene.sigma_mm(k, at); }

  /// Measured, and seen less steeply than a step, from k over `kSheetPx` pixels in direction `way`.
  bool sheet(int k, int way, double pitch) const {
    if (k + way * kSheetPx < 0 || k + way * kSheetPx >= size()) return false;
    for (int i = 0; i <= kSheetPx; ++i)
      if (!(z(k + way * i) > 0)) return false;
    return std::abs(z(k + way * kSheetPx) - z(k)) < kSheetPx * kSheet * pitch;
  }
};

/// Calls step(begin, end, height, steepest / limit) for each run of steep pairs of one sense.
template <typename Step>
void each_step(const Line& line, const Step& step) {
  for (int k = 0; k + 1 < line.size();) {
    const double pitch = line.z(k) / line.focal(), first = line.z(k + 1) - line.z(k);
    if (!(std::abs(first) > kSteep * pitch + 2 * line.sigma(k))) {  // holes too
      ++k;
      continue;
    }
    const double sign = first > 0 ? 1 : -1;
    double steepest = sign * first;
    int end = k + 1;
    while (end + 1 < line.size()) {
      const double next = sign * (line.z(end + 1) - line.z(end));
      if (!(next > kSteep * pitch)) break;
      steepest = std::max(steepest, next);
      ++end;
    }
    step(k, end, sign * (line.z(end) - line.z(k)), steepest / (kSteep * pitch));
    k = end;
  }
}

/// The blur of each step on a line [px].
void blurs_of(const Line& line, std::vector<float>& out) {
  each_step(line, [&](int begin, int end, double height, double ratio) {
    const double pitch = line.z(begin) / line.focal();
    if (height > std::max(kNoises * line.sigma(begin), kPitches * pitch) && ratio > 1 && line.sheet(begin, -1, pitch) &&
        line.sheet(end, 1, pitch))
      // A Gaussian falls from its peak, the steepest pair, to the limit of steepness within half the run.
      out.push_back(static_cast<float>(0.5 * (end - begin) / std::sqrt(2 * std::log(ratio))));
  });
}

}  // namespace

double edge_blur_px(const SceneDepth& scene) {
  const Image<float>& z = scene.z_mm;
  const int row_step = (z.height + kLines - 1) / kLines, column_step = (z.width + kLines - 1) / kLines;
  const int rows = row_step > 0 ? z.height / row_step : 0, columns = column_step > 0 ? z.width / column_step : 0;
  constexpr int kRange = 32;
  std::vector<std::vector<float>> found(static_cast<std::size_t>((rows + columns + kRange - 1) / kRange));
  parallel_ranges(rows + columns, kRange, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const bool column = i >= rows;
      blurs_of({scene, column, column ? (i - rows) * column_step : i * row_step},
               found[static_cast<std::size_t>(begin / kRange)]);
    }
  });
  std::vector<float> blurs;
  for (const std::vector<float>& f : found) blurs.insert(blurs.end(), f.begin(), f.end());
  if (blurs.size() < kLeast) return 0;
  const auto middle = blurs.begin() + static_cast<std::ptrdiff_t>(blurs.size() / 2);
  std::nth_element(blurs.begin(), middle, blurs.end());
  return *middle < kSharp ? 0 : *middle;
}

Image<std::uint8_t> mixed_pixels(const SceneDepth& scene) {
  if (!(scene.edge_blur_px > 0)) return {};
  Image<std::uint8_t> out(scene.z_mm.width, scene.z_mm.height, 0);
  // Half of a drawn-out step is steep; a sd of the blur on either side is what leads over.
  const int beside = static_cast<int>(std::ceil(scene.edge_blur_px));
  const auto mark = [&](const Line& line) {
    each_step(line, [&](int begin, int end, double, double) {
      for (int k = std::max(0, begin - beside); k <= std::min(line.size() - 1, end + beside); ++k)
        (line.column ? out(line.at, k) : out(k, line.at)) = 1;
    });
  };
  // One after the other: rows and columns cross.
  for (int v = 0; v < out.height; ++v) mark({scene, false, v});
  for (int u = 0; u < out.width; ++u) mark({scene, true, u});
  return out;
}

}  // namespace tribin
