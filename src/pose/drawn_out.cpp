#include "tribin/pose/drawn_out.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tribin {
namespace {

/// Distances on the raster: a side counts 5, a diagonal 7 (a fifth of a pixel each).
constexpr int kSide = 5, kDiagonal = 7, kFar = 1 << 20;

/// How far each pixel lies from the nearest one whose distance is 0 now.
void spread(const DrawnOut& w, std::vector<int>& distance) {
  const auto relax = [&](int i, int j, int di, int dj) {
    if (i + di < 0 || j + dj < 0 || i + di >= w.width || j + dj >= w.height) return;
    int& d = distance[w.index(i, j)];
    d = std::min(d, distance[w.index(i + di, j + dj)] + (di != 0 && dj != 0 ? kDiagonal : kSide));
  };
  for (int j = 0; j < w.height; ++j)
    for (int i = 0; i < w.width; ++i) {
      relax(i, j, -1, 0), relax(i, j, -1, -1), relax(i, j, 0, -1), relax(i, j, 1, -1);
    }
  for (int j = w.height - 1; j >= 0; --j)
    for (int i = w.width - 1; i >= 0; --i) {
      relax(i, j, 1, 0), relax(i, j, 1, 1), relax(i, j, 0, 1), relax(i, j, -1, 1);
    }
}

/// Along rows or columns, over the pixels that are known (> 0).
void blur(const DrawnOut& w, double sd, bool rows, std::vector<float>& z) {
  const int reach = static_cast<int>(std::ceil(2.5 * sd));
  std::vector<float> kernel(static_cast<std::size_t>(reach) + 1);
  for (int k = 0; k <= reach; ++k)
    kernel[static_cast<std::size_t>(k)] = static_cast<float>(std::exp(-0.5 * k * k / (sd * sd)));
  const std::vector<float> from = z;
  for (int j = 0; j < w.height; ++j)
    for (int i = 0; i < w.width; ++i) {
      if (!(from[w.index(i, j)] > 0)) continue;
      float sum = 0, weights = 0;
      for (int k = -reach; k <= reach; ++k) {
        const int ii = rows ? i + k : i, jj = rows ? j : j + k;
        if (ii < 0 || jj < 0 || ii >= w.width || jj >= w.height) continue;
        const float value = from[w.index(ii, jj)], weight = kernel[static_cast<std::size_t>(std::abs(k))];
        if (!(value > 0)) continue;
        sum += weight * value;
        weights += weight;
      }
      z[w.index(i, j)] = sum / weights;
    }
}

}  // namespace

DrawnOut draw_out(const SceneDepth& scene, const IndexRender& render) {
  DrawnOut out;
  const int rim = scene.rim(render.step), margin = 2 * rim;
  if (rim == 0 || render.width == 0) return out;
  out.left = std::min(margin, render.u0 / render.step);
  out.top = std::min(margin, render.v0 / render.step);
  out.width = out.left + std::min(render.width + margin, (scene.z_mm.width - 1 - render.u0) / render.step + 1);
  out.height = out.top + std::min(render.height + margin, (scene.z_mm.height - 1 - render.v0) / render.step + 1);
  const std::size_t size = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  const auto seen = [&](int i, int j) {
    i -= out.left, j -= out.top;
    return i >= 0 && j >= 0 && i < render.width && j < render.height && render.triangle[render.index(i, j)] >= 0;
  };

  // The part, and what the scan shows around it.
  std::vector<float> z(size, 0.f);
  std::vector<int> outside(size, kFar), inside(size, kFar);
  for (int j = 0; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) {
      const std::size_t k = out.index(i, j);
      const float measured =
          scene.z_mm(render.u0 + (i - out.left) * render.step, render.v0 + (j - out.top) * render.step);
      if (seen(i, j)) {
        z[k] = 1 / render.inverse_z[render.index(i - out.left, j - out.top)];
        outside[k] = 0;
      } else {
        z[k] = measured > 0 ? measured : 0;
        inside[k] = 0;
      }
    }
  spread(out, outside);
  spread(out, inside);
  // Beside the outline the scan is mixed already: what lies beyond goes on up to it, pixel by pixel inwards.
  std::vector<std::uint32_t> ring;
  for (std::size_t k = 0; k < size; ++k)
    if (outside[k] > 0 && outside[k] <= rim * kSide) {
      ring.push_back(static_cast<std::uint32_t>(k));
      z[k] = 0;
    }
  std::stable_sort(ring.begin(), ring.end(), [&](auto a, auto b) { return outside[a] > outside[b]; });
  for (const std::uint32_t k : ring) {
    const int i = static_cast<int>(k % static_cast<std::size_t>(out.width)),
              j = static_cast<int>(k / static_cast<std::size_t>(out.width));
    float sum = 0;
    int known = 0;
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di) {
        if (i + di < 0 || j + dj < 0 || i + di >= out.width || j + dj >= out.height) continue;
        const std::size_t n = out.index(i + di, j + dj);
        if (outside[n] <= 0 || !(z[n] > 0)) continue;
        sum += z[n];
        ++known;
      }
    if (known > 0) z[k] = sum / static_cast<float>(known);
  }

  const double sd = scene.edge_blur_px / render.step;
  blur(out, sd, true, z);
  blur(out, sd, false, z);
  out.z_mm.assign(size, 0.f);
  out.sigma_mm.assign(size, 0.f);
  for (int j = 1; j + 1 < out.height; ++j)
    for (int i = 1; i + 1 < out.width; ++i) {
      const std::size_t k = out.index(i, j);
      if (std::max(outside[k], inside[k]) > rim * kSide || !(z[k] > 0)) continue;
      const auto slope = [&](std::size_t a, std::size_t b) { return z[a] > 0 && z[b] > 0 ? 0.5f * (z[b] - z[a]) : 0; };
      const float gx = slope(k - 1, k + 1), gy = slope(out.index(i, j - 1), out.index(i, j + 1));
      out.z_mm[k] = z[k];
      out.sigma_mm[k] = static_cast<float>(0.5 * sd) * std::hypot(gx, gy);
    }
  return out;
}

}  // namespace tribin
