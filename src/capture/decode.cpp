#include "tribin/capture/decode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "capture/decode_stretch.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using namespace capture_detail;

constexpr int kRows = 32;

/// Settles the orders of a row whose set has no half-stripe words. Pixels in the middle half of a fringe have their
/// order from the code, beyond doubt; between two of them less than a fringe apart, on one surface then, the others lie
/// on the way from one to the other, and an order that is off by one is far from it.
void settle_by_neighbours(float* x, int width, float period) {
  constexpr int kReach = 96;  // px that a quarter of a fringe may take in the camera image
  int left = -1;
  for (int u = 0; u < width; ++u) {
    const auto fringes = [&](int i) { return (x[i] + 0.5f) / period; };
    const auto trusted = [&](int i) {
      const float at = fringes(i), turn = at - std::floor(at);
      return turn >= 0.25f && turn <= 0.75f;  // false for NaN
    };
    if (!trusted(u)) continue;
    if (left >= 0 && u - left > 1 && u - left <= 2 * kReach) {
      const float from = fringes(left), step = (fringes(u) - from) / static_cast<float>(u - left);
      if (std::abs(fringes(u) - from) < 1)
        for (int i = left + 1; i < u; ++i) {
          const float off = from + step * static_cast<float>(i - left) - fringes(i), turns = std::round(off);
          if (std::abs(turns) == 1 && std::abs(off - turns) < 0.35f) x[i] += turns * period;
        }
    }
    left = u;
  }
}

/// sd of a pixel's noise, by what the sinusoid leaves over at every 16th row; 2 grey levels where three steps leave
/// nothing over. Rounding to whole values is part of it.
template <class T>
float estimate_noise(const Job<T>& job) {
  constexpr float kUnknown = 2, kLeast = 0.29f;  // the latter: rounding alone, 1 / sqrt(12)
  const AxisPlan& axis = job.plan.axes[0];
  const Fringe& fringe = axis.fringes[0];
  const float steps = static_cast<float>(fringe.images.size());
  if (steps < 4) return kUnknown;
  const Image<T>& image = job.images[0];
  auto w = std::make_unique<Workspace>();
  std::vector<float> left;
  for (int v = 8; v < image.height; v += 16)
    for (int u = 0; u < image.width; u += kLanes) {
      const int n = std::min(kLanes, image.width - u);
      fit_fringe(job, fringe, u, v, n, w->phasor);
      const Phasor& p = w->phasor;
      for (int i = 0; i < n; ++i) {
        const float power = p.cosine[i] * p.cosine[i] + p.sine[i] * p.sine[i];
        // Only where fringes are: black pixels are clipped at 0 and look quieter than they are.
        if (p.saturated[i] != 0 || power < 25) continue;
        const float size = std::sqrt(std::max(0.0f, p.square[i] - steps * (p.mean[i] * p.mean[i] + 0.5f * power)));
        // Of four whole numbers it is a multiple of a half; spread over it, so that the median is no step function.
        const float spread = static_cast<float>((i * 61 + v) % 128) / 128.0f - 0.5f;
        left.push_back(std::abs(size + 0.5f * spread));
      }
    }
  if (left.size() < 1000) return kUnknown;
  std::nth_element(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(left.size() / 2), left.end());
  constexpr std::array<float, 5> kMedian = {0.4549f, 1.3863f, 2.3660f, 3.3567f, 4.3515f};  // of chi2, by its freedom
  const float median = kMedian[std::min<std::size_t>(fringe.images.size() - 4, 4)];
  return std::max(kLeast, left[left.size() / 2] / std::sqrt(median));
}

/// Do code and phase belong together? Where the finest bit is at its threshold, the phase must be at a border of its
/// words. A frames.json with wrong shifts or periods gives columns that look right and jump by a fringe, so it is told.
template <class T>
void check_code_and_phase(const Job<T>& job, const AxisPlan& axis, Decoded& out) {
  if (axis.bits.empty()) return;
  const int width = job.images[0].width;
  auto w = std::make_unique<Workspace>();
  int edges = 0, far = 0;
  for (int v = 8; v < job.images[0].height; v += 16)
    for (int u = 0; u < width; u += kLanes) {
      const int n = std::min(kLanes, width - u);
      fit_fringe(job, axis.fringes[0], u, v, n, w->phasor);
      turn_and_modulation(w->phasor, n, w->turn[0], w->modulation[0]);
      std::copy_n(w->phasor.mean, n, w->mean);
      settle_by_code(job, axis, u, v, n, *w);
      for (int i = 0; i < n; ++i) {
        const float m = w->modulation[0][i];
        if (m < 2 * job.dark || w->phasor.saturated[i] != 0 || std::abs(w->code.difference[0][i]) > 0.3f * m) continue;
        const double place = w->turn[0][i] * axis.words_per_fringe;
        ++edges;
        far += std::abs(place - std::round(place)) > 0.25;
      }
    }
  if (edges < 200 || far < edges / 2) return;
  out.warnings.push_back(
      "code and phase do not belong together: " + std::to_string(100 * far / edges) +
      " % of the finest bit's edges lie inside of fringes; check period_px and shift_deg in frames.json");
}

template <class T>
Decoded decode_images(const FrameStack& frames, const std::vector<Image<T>>& images, const DecodePlan& plan,
                      const DecodeOptions& options) {
  const double full = options.full_scale > 0  ? options.full_scale
                      : frames.full_scale > 0 ? frames.full_scale
                                              : std::numeric_limits<T>::max();
  Job<T> job{images, plan};
  job.scale = static_cast<float>(255 / full);
  job.limit = 255 - 0.5f * std::min(1.0f, job.scale);
  job.noise = options.image_noise > 0 ? static_cast<float>(options.image_noise) : estimate_noise(job);
  const double steps = static_cast<double>(plan.axes[0].fringes[0].images.size());
  // Noise alone has Rayleigh-distributed modulation: it exceeds 5 sd at one pixel in 270,000.
  job.dark = options.min_modulation > 0 ? static_cast<float>(options.min_modulation)
                                        : static_cast<float>(5 * std::sqrt(2 / steps)) * job.noise;
  const int width = frames.width(), height = frames.height();
  Decoded out;
  out.modulation = out.invalid_reason = out.brightness = Image<std::uint8_t>(width, height, 0);
  out.image_noise = job.noise;
  for (const AxisPlan& axis : plan.axes) {
    const bool column = axis.axis == PatternAxis::column;
    (column ? out.column : out.row) = Image<float>(width, height);
    (column ? out.column_noise : out.row_noise) = axis.noise_factor * job.noise;
  }
  for (const AxisPlan& axis : plan.axes) check_code_and_phase(job, axis, out);
  parallel_ranges(height, kRows, [&](int begin, int end) {
    auto w = std::make_unique<Workspace>();
    for (int v = begin; v < end; ++v) {
      for (int u = 0; u < width; u += kLanes)
        for (const AxisPlan& axis : plan.axes)
          decode_lanes(job, axis, &axis == plan.axes.data(), u, v, std::min(kLanes, width - u), *w, out);
      for (const AxisPlan& axis : plan.axes)
        if (axis.axis == PatternAxis::column && !axis.bits.empty() && axis.words_per_fringe == 1)
          settle_by_neighbours(out.column.row(v), width, static_cast<float>(axis.fringes[0].period));
    }
  });
  return out;
}

/// The frames of one exposure.
Decoded decode_one(const FrameStack& frames, const DecodeOptions& options) {
  const DecodePlan plan = plan_decoding(frames.patterns, frames.camera);
  if (!frames.grey8.empty()) return decode_images(frames, frames.grey8, plan, options);
  return decode_images(frames, frames.grey16, plan, options);
}

void check_sizes(const FrameStack& frames) {
  const std::size_t images = std::max(frames.grey8.size(), frames.grey16.size());
  TRIBIN_ASSERT(frames.grey8.empty() || frames.grey16.empty());
  TRIBIN_ASSERT(images == frames.patterns.size());
  const auto check = [&](const auto& stack) {
    for (std::size_t i = 0; i < stack.size(); ++i)
      if (stack[i].width != frames.width() || stack[i].height != frames.height())
        throw Error(ErrorCode::bad_input, (i < frames.files.size() ? frames.files[i] : frames.camera) + ": size: saw " +
                                              std::to_string(stack[i].width) + " x " + std::to_string(stack[i].height) +
                                              ", wanted " + std::to_string(frames.width()) + " x " +
                                              std::to_string(frames.height()) + " as the first image");
  };
  check(frames.grey8);
  check(frames.grey16);
}

}  // namespace

Decoded decode(const FrameStack& frames, const DecodeOptions& options) {
  check_sizes(frames);
  std::vector<double> exposures;
  for (const Pattern& p : frames.patterns) exposures.push_back(p.exposure_ms);
  std::sort(exposures.begin(), exposures.end());
  exposures.erase(std::unique(exposures.begin(), exposures.end()), exposures.end());
  if (exposures.size() <= 1) return decode_one(frames, options);
  std::vector<Decoded> parts;
  for (const double exposure : exposures) {
    FrameStack part;
    part.camera = frames.camera;
    for (std::size_t i = 0; i < frames.patterns.size(); ++i) {
      if (frames.patterns[i].exposure_ms != exposure) continue;
      part.patterns.push_back(frames.patterns[i]);
      if (!frames.grey8.empty()) part.grey8.push_back(frames.grey8[i]);
      if (!frames.grey16.empty()) part.grey16.push_back(frames.grey16[i]);
    }
    parts.push_back(decode_one(part, options));
  }
  return merge_exposures(parts);
}

}  // namespace tribin
