#include "tribin/capture/patterns.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tribin/core/error.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin {
namespace {

void check(const PatternOptions& o) {
  const auto want = [](bool good, const char* what) {
    if (!good) throw Error(ErrorCode::bad_option, std::string("pattern set: wanted ") + what);
  };
  want(o.width >= 8 && o.width <= 16384 && o.height >= 8 && o.height <= 16384, "a projector of 8..16384 pixels a side");
  want(o.period_px >= 4 && o.period_px <= 256, "a fringe period of 4..256 px");
  want(o.steps >= 3 && o.steps <= 8, "3..8 phase steps");
  want(o.columns || o.rows, "columns, rows or both");
  // Half a stripe must end on a pixel's edge: else the code's edge and the phase's differ by a part of a pixel.
  want(o.code != PatternCode::gray || std::fmod(o.period_px, 2.0) == 0, "an even fringe period for Gray code");
}

void add_phase(std::vector<Pattern>& out, PatternAxis axis, double period, int steps, int used) {
  // Darkest at the period's borders, where the Gray code's edges lie.
  for (int k = 0; k < used; ++k)
    out.push_back(
        {.kind = PatternKind::phase, .axis = axis, .period_px = period, .shift_rad = kPi + 2 * kPi * k / steps});
}

void add_gray(std::vector<Pattern>& out, PatternAxis axis, int size, double period) {
  int bits = 1;
  while (std::ldexp(period / 2, bits) < size) ++bits;
  for (int b = 0; b < bits; ++b)
    out.push_back(
        {.kind = PatternKind::gray, .axis = axis, .period_px = std::ldexp(period / 2, bits - 1 - b), .bit = b});
}

/// Fringe counts N, N - 1, N - r, N - r^2, ... with N = r^(F-1), so that each beat is r times as fine as the one before
/// and the coarsest spans the projector; r <= 5 keeps a step's error below half a fringe at 5 sigma of usable phases.
/// Single images of a micro set tell an order by one grey level each: they take twice as many frequencies.
std::vector<double> close_periods(int size, double finest, bool single_images) {
  const double span = 1.25 * size;  // a quarter more: at 6 sd of usable phases, noise at the borders wraps around
  const double count = std::max(4.0, span / finest);
  int waves = single_images ? 5 : 3;
  while (std::pow(count, 1.0 / (waves - 1)) > (single_images ? 2.2 : 5)) ++waves;
  const double ratio = std::pow(count, 1.0 / (waves - 1));
  std::vector<double> periods{span / count};
  for (int i = 0; i + 1 < waves; ++i) periods.push_back(span / (count - std::pow(ratio, i)));
  return periods;
}

}  // namespace

std::string_view name_of(PatternKind kind) {
  constexpr std::string_view kNames[] = {"phase", "gray", "gray_inverse", "white", "black"};
  return kNames[static_cast<int>(kind)];
}

std::string_view name_of(PatternAxis axis) { return axis == PatternAxis::column ? "column" : "row"; }

double pattern_value(const Pattern& p, double x) {
  switch (p.kind) {
    case PatternKind::phase:
      return 0.5 + 0.5 * std::cos(2 * kPi * x / p.period_px + p.shift_rad);
    case PatternKind::gray:
    case PatternKind::gray_inverse: {
      const double word = std::floor(x / p.period_px), place = word - 4 * std::floor(word / 4);
      return (place == 1 || place == 2) == (p.kind == PatternKind::gray) ? 1 : 0;
    }
    case PatternKind::white:
      return 1;
    case PatternKind::black:
      break;
  }
  return 0;
}

Image<std::uint8_t> draw_pattern(const Pattern& pattern, int width, int height, double gamma) {
  Image<std::uint8_t> out(width, height);
  const bool columns = pattern.axis == PatternAxis::column;
  std::vector<std::uint8_t> line(static_cast<std::size_t>(columns ? width : height));
  for (std::size_t i = 0; i < line.size(); ++i) {
    const double value = std::pow(pattern_value(pattern, static_cast<double>(i) + 0.5), 1 / gamma);
    line[i] = static_cast<std::uint8_t>(std::lround(255 * value));
  }
  for (int v = 0; v < height; ++v) {
    if (columns)
      std::copy(line.begin(), line.end(), out.row(v));
    else
      std::fill_n(out.row(v), width, line[static_cast<std::size_t>(v)]);
  }
  return out;
}

std::vector<Pattern> make_patterns(const PatternOptions& o) {
  check(o);
  std::vector<Pattern> out{{.kind = PatternKind::white}, {.kind = PatternKind::black}};
  for (const PatternAxis axis : {PatternAxis::column, PatternAxis::row}) {
    if (!(axis == PatternAxis::column ? o.columns : o.rows)) continue;
    const int size = axis == PatternAxis::column ? o.width : o.height;
    if (o.code == PatternCode::gray) {
      add_phase(out, axis, o.period_px, o.steps, o.steps);
      add_gray(out, axis, size, o.period_px);
      continue;
    }
    const std::vector<double> periods = close_periods(size, o.period_px, o.code == PatternCode::micro);
    for (std::size_t i = 0; i < periods.size(); ++i)
      add_phase(out, axis, periods[i], o.steps, o.code == PatternCode::micro && i > 0 ? 1 : o.steps);
  }
  return out;
}

std::string pattern_file_name(const std::vector<Pattern>& patterns, std::size_t index) {
  const Pattern& p = patterns[index];
  char head[8];
  std::snprintf(head, sizeof head, "%02zu_", index);
  std::string name = head;
  if (p.kind != PatternKind::white && p.kind != PatternKind::black) name += std::string(name_of(p.axis)) + "_";
  name += name_of(p.kind);
  if (p.bit >= 0) name += "_" + std::to_string(p.bit);
  return name + ".png";
}

}  // namespace tribin
