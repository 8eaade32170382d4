#include "surfel/cell_noise.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tribin/core/parallel.hpp"

namespace tribin::surfel_detail {
namespace {

constexpr double kMadToSigma = 1.4826;  // of a normal distribution

/// Quantile of sqrt(chi2_k / k) at the normal quantile z (Wilson-Hilferty).
double chi_quantile(double k, double z) {
  const double t = 2.0 / (9.0 * k);
  return std::pow(std::max(0.0, 1.0 - t + z * std::sqrt(t)), 1.5);
}

/// Variance of z[0] - 3 z[L] + 3 z[2L] - z[3L] for unit noise.
double third_difference_variance(int lag, double c) {
  return 20.0 - 30.0 * noise_correlation(lag, c) + 12.0 * noise_correlation(2 * lag, c) -
         2.0 * noise_correlation(3 * lag, c);
}

/// A number in [-0.5, 0.5) that depends on the pixel only: breaks the ties of quantised depths.
double dither(std::uint32_t index) {
  std::uint32_t h = index * 2654435761u;
  h ^= h >> 15;
  h *= 2246822519u;
  h ^= h >> 13;
  return h / 4294967296.0 - 0.5;
}

double median(std::vector<float>& values) {
  if (values.empty()) return 0;
  auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double noise_correlation(double distance_px, double c) {
  if (distance_px == 0) return 1;
  return c > 0.05 ? std::exp(-distance_px * distance_px / (4.0 * c * c)) : 0.0;
}

CellNoise cell_noise(int n, double c) {
  const int count = n * n;
  // Least squares on a full cell: mean, u-slope and v-slope are orthogonal.
  const double half = 0.5 * (n - 1);
  double sum_uu = 0;
  for (int i = 0; i < count; ++i) sum_uu += (i % n - half) * (i % n - half);
  std::vector<double> correlation(static_cast<std::size_t>(count) * count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      correlation[static_cast<std::size_t>(i) * count + j] =
          noise_correlation(std::hypot(i % n - j % n, i / n - j / n), c);
  double var_mean = 0, var_slope = 0;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      const double r = correlation[static_cast<std::size_t>(i) * count + j];
      var_mean += r / (double(count) * count);
      var_slope += r * (i % n - half) * (j % n - half) / (sum_uu * sum_uu);
    }
  // Residual = M noise with M = I - P: mean square tr(M C) / n, effective degrees of freedom tr(MC)^2 / tr(MCMC).
  const auto projector = [&](int i, int j) {
    return 1.0 / count + ((i % n - half) * (j % n - half) + (i / n - half) * (j / n - half)) / sum_uu;
  };
  std::vector<double> mc(static_cast<std::size_t>(count) * count);
  double trace = 0;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      double s = correlation[static_cast<std::size_t>(i) * count + j];
      for (int k = 0; k < count; ++k) s -= projector(i, k) * correlation[static_cast<std::size_t>(k) * count + j];
      mc[static_cast<std::size_t>(i) * count + j] = s;
      if (i == j) trace += s;
    }
  double trace2 = 0;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      trace2 += mc[static_cast<std::size_t>(i) * count + j] * mc[static_cast<std::size_t>(j) * count + i];
  const double dof = trace * trace / std::max(trace2, 1e-12);
  const double rms = std::sqrt(trace / count);

  CellNoise noise;
  noise.mean = std::sqrt(var_mean);
  noise.slope = std::sqrt(var_slope);
  noise.residual_quantile = rms * chi_quantile(dof, -0.5244);
  noise.residual_limit = rms * chi_quantile(dof, 3.54);
  noise.information = std::max(1.0, 4.0 * kPi * c * c / (count * var_mean));
  return noise;
}

ThirdDifferences noise_from_third_differences(const Scan& scan, const Image<float>& steps) {
  constexpr int kFar = 4;                 // lag of the second MAD: independent samples up to c of about 1.5 px
  constexpr int kSpan = 3 * kFar;         // both are taken where all samples of the far one are valid
  constexpr std::size_t kWanted = 20000;  // samples each way: the median is then good to 1 %
  const Image<float>& z = scan.z_mm;
  const std::size_t total = 2 * z.size();
  const int stride = std::max<int>(1, static_cast<int>(total / kWanted / 2));
  std::vector<float> near_of[2], far_of[2], quantum_of[2];  // along rows, along columns
  parallel_each(2, [&](int axis) {
    std::vector<float>&near_abs = near_of[axis], &far_abs = far_of[axis], &quantum = quantum_of[axis];
    for (auto* v : {&near_abs, &far_abs, &quantum}) v->reserve(kWanted + 1024);
    const int du = axis == 0 ? 1 : 0, dv = 1 - du;
    for (int v = 0; v + kSpan * dv < z.height; ++v)
      // A phase for each row, so that samples do not line up in columns.
      for (int u = static_cast<int>((axis * 7919u + v * 7u) % stride); u + kSpan * du < z.width; u += stride) {
        float s[kSpan + 1];
        bool valid = true;
        for (int i = 0; i <= kSpan && valid; ++i) {
          s[i] = z(u + i * du, v + i * dv);
          valid = std::isfinite(s[i]);
        }
        if (!valid) continue;
        const float step = steps(u / kQuantisationTile, v / kQuantisationTile);
        // In inverse depth, where planes are affine, brought back to millimetres at this place.
        const double scale = static_cast<double>(s[0]) * s[0];
        const auto w = [&](int i) {
          const std::uint32_t index = static_cast<std::uint32_t>(z.index(u + i * du, v + i * dv));
          return 1.0 / (s[i] + step * dither(index));
        };
        near_abs.push_back(static_cast<float>(std::abs(w(0) - 3 * w(1) + 3 * w(2) - w(3)) * scale));
        far_abs.push_back(static_cast<float>(std::abs(w(0) - 3 * w(kFar) + 3 * w(2 * kFar) - w(3 * kFar)) * scale));
        quantum.push_back(step);
      }
  });
  const auto joined = [](std::vector<float>(&of)[2]) {
    of[0].insert(of[0].end(), of[1].begin(), of[1].end());
    return std::move(of[0]);
  };
  std::vector<float> near_abs = joined(near_of), far_abs = joined(far_of), quantum = joined(quantum_of);
  ThirdDifferences result;
  if (far_abs.empty()) return result;
  const double dither_variance = 20.0 * std::pow(median(quantum), 2) / 12.0;
  const auto variance = [&](std::vector<float>& abs) {
    const double sd = kMadToSigma * median(abs);
    return std::max(sd * sd - dither_variance, 0.05 * sd * sd);
  };
  const double near_var = variance(near_abs), far_var = variance(far_abs);
  const double ratio = far_var > 0 ? near_var / far_var : 1.0;
  // The ratio falls with c from 1 at c = 0; bisection. Depth edges only raise the far one, so c is capped at what
  // sensors have.
  double low = 0, high = 2.5;
  for (int i = 0; i < 40; ++i) {
    const double c = 0.5 * (low + high);
    (third_difference_variance(1, c) / third_difference_variance(kFar, c) > ratio ? low : high) = c;
  }
  result.correlation_px = ratio < 0.995 ? 0.5 * (low + high) : 0.0;
  result.sigma_mm = std::sqrt(far_var / third_difference_variance(kFar, result.correlation_px));
  return result;
}

Image<float> quantisation_steps(const Scan& scan) {
  constexpr int tile_px = kQuantisationTile;
  const Image<float>& z = scan.z_mm;
  Image<float> steps((z.width + tile_px - 1) / tile_px, (z.height + tile_px - 1) / tile_px, 0.0f);
  parallel_ranges(steps.height, 1, [&](int begin, int end) {
    std::vector<float> jumps;
    for (int tv = begin; tv < end; ++tv)
      for (int tu = 0; tu < steps.width; ++tu) {
        jumps.clear();
        const int v_end = std::min(z.height, (tv + 1) * tile_px), u_end = std::min(z.width - 1, (tu + 1) * tile_px);
        for (int v = tv * tile_px; v < v_end; v += 8) {  // each eighth row: some 100 jumps suffice
          const float* row = z.row(v);
          for (int u = tu * tile_px; u < u_end; ++u) {
            const float jump = std::abs(row[u + 1] - row[u]);
            // Depths in float carry rounding of 1e-7 of their size; that is no step.
            if (jump > 2e-7f * row[u]) jumps.push_back(jump);
          }
        }
        if (jumps.size() < 10) continue;
        // A low quantile of continuous noise is a few hundredths of its sigma, harmless; of quantised depth it is the
        // step.
        auto low = jumps.begin() + static_cast<std::ptrdiff_t>(jumps.size() / 50);
        std::nth_element(jumps.begin(), low, jumps.end());
        steps(tu, tv) = *low;
      }
  });
  return steps;
}

}  // namespace tribin::surfel_detail
