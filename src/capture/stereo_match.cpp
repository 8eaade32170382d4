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
  parallel_ranges(std::min(h, second.column.height), 32, [&](int begin, int end) {
    std::vector<Gap> gaps;
    for (int v = begin; v < end; ++v) {
      const float* row = second.column.row(v);
      gaps.clear();
      float widest = 0;
      const float jump = 6 * second.step;  // as `resample`: three times the usual slant, both ways
      for (int u = 0; u + 1 < other; ++u) {
        const float low = std::min(row[u], row[u + 1]), high = std::max(row[u], row[u + 1]);
        if (!(high - low <= jump)) continue;  // NaN too
        gaps.push_back({low, high, u});
        widest = std::max(widest, high - low);
      }
      std::sort(gaps.begin(), gaps.end(),
                [](const Gap& p, const Gap& q) { return p.low != q.low ? p.low < q.low : p.u < q.u; });
      for (int u = 0; u < w; ++u) {
        const float x = first.column(u, v);
        if (!std::isfinite(x)) continue;
        auto gap =
            std::lower_bound(gaps.begin(), gaps.end(), x - widest, [](const Gap& g, float at) { return g.low < at; });
        int least = other, most = -1;
        double sum = 0;
        int count = 0;
        for (; gap != gaps.end() && gap->low <= x; ++gap) {
          if (gap->high < x) continue;
          least = std::min(least, gap->u), most = std::max(most, gap->u);
          sum += gap->u + (gap->high > gap->low ? 0.5 : 0), ++count;
        }
        // Noise makes a column cross x several times within a few pixels; further apart it is seen in two places.
        if (count == 0 || most - least > 2 * kHalf + 1) continue;
        const Line line = place_of(row, other, static_cast<int>(std::lround(sum / count)), x, jump);
        out.column(u, v) = static_cast<float>(line.column);
        out.slope(u, v) = static_cast<float>(line.slope);
        out.noise_share(u, v) = static_cast<float>(line.noise_share);
      }
    }
  });
  return out;
}

}  // namespace tribin::capture_detail
