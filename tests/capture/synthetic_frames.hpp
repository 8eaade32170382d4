#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "tribin/capture/decode.hpp"

namespace tribin::test {

/// How a synthetic camera takes patterns.
struct SyntheticCamera {
  double modulation = 60;  ///< grey levels: half the swing of white and black
  double ambient = 20;     ///< grey levels
  double noise = 2;        ///< sd of a grey level
  double blur_px = 1;      ///< sd of the projector's defocus [projector px]
  double gain = 1;         ///< of a longer exposure
  int full_scale = 255;
};

/// A pattern as the camera sees it through a defocused projector: blurred by a Gaussian, in closed form for sinusoids,
/// by the nearest edges for code words.
inline double blurred_value(const Pattern& p, double x, double sd) {
  if (p.kind == PatternKind::phase)
    return 0.5 + (pattern_value(p, x) - 0.5) * std::exp(-2 * std::pow(M_PI * sd / p.period_px, 2));
  if (p.kind == PatternKind::white || p.kind == PatternKind::black || sd <= 0) return pattern_value(p, x);
  // Edges of a bit lie at odd multiples of its word.
  double value = 0;
  const double word = p.period_px, first = 2 * std::floor((x / word - 1) / 2) + 1;
  for (int e = -3; e <= 3; ++e) {
    const double edge = (first + 2 * e) * word;
    const double step = pattern_value(p, edge + word / 2) - pattern_value(p, edge - word / 2);
    if (e == -3) value = pattern_value(p, edge - word / 2);
    value += step * 0.5 * std::erfc(-(x - edge) / (std::sqrt(2.0) * sd));
  }
  return value;
}

/// Frames of a scene whose pixel (u, v) looks at projector coordinates column(u, v), row(u, v), counted from the edge
/// of pixel 0, with `albedo` on modulation and ambient light.
template <class Column, class Row, class Albedo>
FrameStack synthetic_frames(const std::vector<Pattern>& patterns, int width, int height, const SyntheticCamera& camera,
                            unsigned seed, Column column, Row row, Albedo albedo) {
  FrameStack out;
  out.camera = "synthetic";
  out.patterns = patterns;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, camera.noise);
  const bool wide = camera.full_scale > 255;
  for (const Pattern& p : patterns) {
    Image<std::uint16_t> image(width, height);
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const double x = p.axis == PatternAxis::column ? column(u, v) : row(u, v), a = albedo(u, v) * camera.gain;
        const double light = a * (camera.ambient + 2 * camera.modulation * blurred_value(p, x, camera.blur_px));
        const double grey = (light + normal(random)) * (camera.full_scale / 255.0);
        image(u, v) = static_cast<std::uint16_t>(std::clamp<long>(std::lround(grey), 0, camera.full_scale));
      }
    if (wide) {
      out.grey16.push_back(image);
    } else {
      Image<std::uint8_t> narrow(width, height);
      std::copy(image.data.begin(), image.data.end(), narrow.data.begin());
      out.grey8.push_back(narrow);
    }
  }
  return out;
}

}  // namespace tribin::test
