#include "capture/stereo_match.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tribin/core/parallel.hpp"

namespace tribin::capture_detail {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kHalf = 2;  // five pixels: the second view adds a fifth of its variance, and neighbours hardly correlate

/// Two neighbouring pixels of the second view, between which a column lies.
struct Gap {
  float low = 0, high = 0;  ///< columns
  int u = 0;                ///< the left pixel
};

struct Line {
  double column = std::numeric_limits<double>::quiet_NaN(), slope = 0, noise_share = 1;
};

/// The gaps of a row in cells of equal width by their lower end, so that a column is looked up in a few of them.
struct Gaps {
  std::vector<Gap> all, unsorted;
  std::vector<int> begin;  ///< of each cell in `all`, and the end
  std::vector<int> next;   ///< free place of each cell while they are filled
  float first = 0, per_cell = 0, widest = 0;

  void fill(const float* row, int width, float jump) {
    unsorted.clear();
    widest = 0;
    float least = std::numeric_limits<float>::max(), most = std::numeric_limits<float>::lowest();
    for (int u = 0; u + 1 < width; ++u) {
      const float low = std::min(row[u], row[u + 1]), high = std::max(row[u], row[u + 1]);
      if (!(high - low <= jump)) continue;  // NaN too
      unsorted.push_back({low, high, u});
      widest = std::max(widest, high - low);
      least = std::min(least, low), most = std::max(most, low);
    }
    // Cells as wide as the widest gap: one that holds a column begins in the column's cell or in the one before. Not
    // more cells than pixels.
    first = unsorted.empty() ? 0 : least;
    const float range = unsorted.empty() ? 0 : most - least, cell = std::max(widest, range / static_cast<float>(width));
    per_cell = cell > 0 ? 1 / cell : 0;
    begin.assign(static_cast<std::size_t>(range * per_cell) + 2, 0);
    for (const Gap& g : unsorted) ++begin[cell_of(g.low) + 1];
    for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
    all.resize(unsorted.size());
    next.assign(begin.begin(), begin.end());
    for (const Gap& g : unsorted) all[static_cast<std::size_t>(next[cell_of(g.low)]++)] = g;
  }

  /// The pixel nearest to where the row has column x; -1 where it has it nowhere, or in places further apart than noise
  /// makes a column cross x several times.
  int single_place(float x) const {
    if (all.empty() || x < first) return -1;
    const std::size_t cells = begin.size() - 1, to = std::min(static_cast<std::size_t>((x - first) * per_cell), cells);
    // One cell more than needed on either side makes rounding harmless.
    const std::size_t from = to < 2 ? 0 : to - 2, end = std::min(to + 2, cells);
    if (from >= end) return -1;
    int least = std::numeric_limits<int>::max(), most = -1, count = 0;
    double sum = 0;
    for (int i = begin[from]; i < begin[end]; ++i) {
      const Gap& gap = all[static_cast<std::size_t>(i)];
      if (gap.low > x || gap.high < x) continue;
      least = std::min(least, gap.u), most = std::max(most, gap.u);
      sum += gap.u + (gap.high > gap.low ? 0.5 : 0), ++count;
    }
    if (count == 0 || most - least > 2 * kHalf + 1) return -1;
    return static_cast<int>(std::lround(sum / count));
  }

  std::size_t cell_of(float low) const { return static_cast<std::size_t>((low - first) * per_cell); }
};

/// The place of projector column x near pixel u of a row, by a line through the pixels of one surface about it.
Line place_of(const float* row, int width, int u, float x, float jump) {
  double n = 0, s1 = 0, s2 = 0, sx = 0, s1x = 0;
  for (const int side : {-1, 1}) {
    float before = row[u];
    for (int i = side < 0 ? 0 : 1; i <= kHalf; ++i) {
      const int at = u + side * i;
      if (at < 0 || at >= width || !std::isfinite(row[at]) || std::abs(row[at] - before) > jump) break;
      before = row[at];
      const double d = at - u;
      n += 1, s1 += d, s2 += d * d, sx += row[at] - x, s1x += d * (row[at] - x);
    }
  }
  Line out;
  const double determinant = n * s2 - s1 * s1;
  if (n < 2 || determinant <= 0) return out;
  const double slope = (n * s1x - s1 * sx) / determinant, offset = (sx - slope * s1) / n;
  if (!(std::abs(slope) > 1e-6)) return out;
  const double d = -offset / slope, mean = s1 / n;
  if (std::abs(d) > kHalf + 1) return out;  // the line is no guide outside of its pixels
  out.column = u + d;
  out.slope = std::abs(slope);
  out.noise_share = 1 / n + (d - mean) * (d - mean) * n / determinant;
  return out;
}

}  // namespace

StereoMatch match_columns(const ViewImage& first, const ViewImage& second) {
  const int w = first.column.width, h = first.column.height, other = second.column.width;
  StereoMatch out{Image<float>(w, h, kNaN), Image<float>(w, h, 0), Image<float>(w, h, 1)};
  // As `resample`: three times the usual slant, both ways.
  const float jump_first = 6 * first.step, jump = 6 * second.step;
  parallel_ranges(std::min(h, second.column.height), 32, [&](int begin, int end) {
    Gaps here, there;
    for (int v = begin; v < end; ++v) {
      const float* row = second.column.row(v);
      here.fill(first.column.row(v), w, jump_first);
      there.fill(row, other, jump);
      for (int u = 0; u < w; ++u) {
        const float x = first.column(u, v);
        if (!std::isfinite(x)) continue;
        const int near = there.single_place(x);
        // A column that the first view has on two surfaces may be met on either by the second.
        if (near < 0 || here.single_place(x) < 0) continue;
        const Line line = place_of(row, other, near, x, jump);
        out.column(u, v) = static_cast<float>(line.column);
        out.slope(u, v) = static_cast<float>(line.slope);
        out.noise_share(u, v) = static_cast<float>(line.noise_share);
      }
    }
  });
  return out;
}

}  // namespace tribin::capture_detail
