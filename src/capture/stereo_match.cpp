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

/// The gaps of a row, by their lower end.
struct Gaps {
  std::vector<Gap> all;
  float widest = 0;

  void fill(const float* row, int width, float jump) {
    all.clear();
    widest = 0;
    for (int u = 0; u + 1 < width; ++u) {
      const float low = std::min(row[u], row[u + 1]), high = std::max(row[u], row[u + 1]);
      if (!(high - low <= jump)) continue;  // NaN too
      all.push_back({low, high, u});
      widest = std::max(widest, high - low);
    }
    std::sort(all.begin(), all.end(),
              [](const Gap& p, const Gap& q) { return p.low != q.low ? p.low < q.low : p.u < q.u; });
  }

  /// The pixel nearest to where the row has column x; -1 where it has it nowhere, or in places further apart than noise
  /// makes a column cross x several times.
  int single_place(float x) const {
    auto gap = std::lower_bound(all.begin(), all.end(), x - widest, [](const Gap& g, float at) { return g.low < at; });
    int least = std::numeric_limits<int>::max(), most = -1, count = 0;
    double sum = 0;
    for (; gap != all.end() && gap->low <= x; ++gap) {
      if (gap->high < x) continue;
      least = std::min(least, gap->u), most = std::max(most, gap->u);
      sum += gap->u + (gap->high > gap->low ? 0.5 : 0), ++count;
    }
    if (count == 0 || most - least > 2 * kHalf + 1) return -1;
    return static_cast<int>(std::lround(sum / count));
  }
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
