#include "sim/noise_field.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/random.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::sim {
namespace {

constexpr int kRows = 64;

/// Gaussian weights with sum of squares 1: filtering white noise by them keeps its sd. Cut at 4 sd.
std::vector<float> unit_kernel(double sd) {
  const int reach = static_cast<int>(std::ceil(4 * sd));
  std::vector<double> weights(2 * reach + 1);
  double squares = 0;
  for (int i = -reach; i <= reach; ++i) {
    const double w = sd > 0 ? std::exp(-0.5 * i * i / (sd * sd)) : 1;
    weights[i + reach] = w;
    squares += w * w;
  }
  std::vector<float> result;
  for (const double w : weights) result.push_back(static_cast<float>(w / std::sqrt(squares)));
  return result;
}

}  // namespace

Image<float> noise_field(int width, int height, double correlation_px, std::uint64_t seed) {
  const std::vector<float> kernel = unit_kernel(correlation_px);
  const int reach = static_cast<int>(kernel.size()) / 2;
  // A margin of white noise all round: the border is as noisy as the middle.
  const int w = width + 2 * reach, h = height + 2 * reach;
  Image<float> white(w, h), across(width, h), result(width, height);
  parallel_ranges(h, kRows, [&](int begin, int end) {
    for (int v = begin; v < end; ++v) {
      Random random(mixed(seed) ^ static_cast<std::uint64_t>(v));
      for (int u = 0; u < w; ++u) white(u, v) = static_cast<float>(random.normal());
      for (int u = 0; u < width; ++u) {
        float sum = 0;
        for (int k = 0; k <= 2 * reach; ++k) sum += kernel[k] * white(u + k, v);
        across(u, v) = sum;
      }
    }
  });
  parallel_ranges(height, kRows, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < width; ++u) {
        float sum = 0;
        for (int k = 0; k <= 2 * reach; ++k) sum += kernel[k] * across(u, v + k);
        result(u, v) = sum;
      }
  });
  return result;
}

}  // namespace tribin::sim
