#include "tribin/capture/decode.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "capture/decode_plan.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/geometry.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using namespace capture_detail;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kRows = 32;

/// What all rows of one decoding share.
template <class T>
struct Job {
  const std::vector<Image<T>>& images;
  const DecodePlan& plan;
  float scale = 1;    ///< values to grey levels
  float limit = 255;  ///< [grey levels] at and above it a value is saturated
  float noise = 0;    ///< sd of a pixel [grey levels]
  float dark = 0;     ///< least modulation [grey levels]
};

/// Buffers of one thread.
struct Workspace {
  Phasor phasor;
  GrayLanes code;
  alignas(64) float turn[8][kLanes], modulation[8][kLanes], mean[kLanes], saturated[kLanes], reference[kLanes],
      other[kLanes], x[kLanes], sum[kLanes], doubt[kLanes], differs[kLanes];
  alignas(64) float cosine[8][kLanes], sine[8][kLanes],
      difference[8][kLanes], residual[kLanes], order[kLanes], best[kLanes], second[kLanes];
};

/// A pixel with saturated images is fitted to the others; false where fewer than three are left.
template <class T>
bool solve_unsaturated(const Job<T>& job, const Fringe& fringe, int u, int v, Phasor& p, int lane) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int used = 0;
  for (const PhaseImage& image : fringe.images) {
    const float value = static_cast<float>(job.images[image.image](u, v)) * job.scale;
    if (value >= job.limit) continue;
    const Eigen::Vector3d a(1, std::cos(image.shift), -std::sin(image.shift));
    normal += a * a.transpose();
    right += a * static_cast<double>(value);
    ++used;
  }
  if (used < 3 || normal.determinant() < 0.1) return false;  // four steps less one have 4, three bunched ones of 8 0.2
  const Eigen::Vector3d fit = normal.ldlt().solve(right);
  p.mean[lane] = static_cast<float>(fit[0]);
  p.cosine[lane] = static_cast<float>(fit[1]);
  p.sine[lane] = static_cast<float>(fit[2]);
  return true;
}

/// Fits the sinusoid of one fringe for n pixels from (u, v) on. `saturated` is then > 0 where that failed, and -1 where
/// some images were left out.
template <class T>
void fit_fringe(const Job<T>& job, const Fringe& fringe, int u, int v, int n, Phasor& p) {
  for (float* lanes : {p.mean, p.cosine, p.sine, p.square, p.saturated}) std::fill_n(lanes, n, 0.0f);
  for (const PhaseImage& image : fringe.images)
    add_phase_image(job.images[image.image].row(v) + u, n, job.scale, job.limit, image.weights, p);
  for (int i = 0; i < n; ++i)
    if (p.saturated[i] > 0 && solve_unsaturated(job, fringe, u + i, v, p, i)) p.saturated[i] = -1;
}

template <class T>
void settle_by_code(const Job<T>& job, const AxisPlan& axis, int u, int v, int n, Workspace& w) {
  const auto grey = [&](int image, float* out) { to_grey(job.images[image].row(v) + u, n, job.scale, out); };
  const bool thresholds = job.plan.white >= 0 && job.plan.black >= 0;
  if (thresholds) {
    grey(job.plan.white, w.reference);
    grey(job.plan.black, w.other);
    for (int i = 0; i < n; ++i) w.reference[i] = 0.5f * (w.reference[i] + w.other[i]);
  }
  std::fill_n(w.code.word, n, 0);
  const int bits = static_cast<int>(axis.bits.size());
  for (int b = 0; b < bits; ++b) {
    const BitImage& bit = axis.bits[b];
    float* difference = w.code.difference[bits - 1 - b];
    grey(bit.image, difference);
    if (bit.inverse >= 0) grey(bit.inverse, w.other);
    const float* reference = bit.inverse >= 0 ? w.other : thresholds ? w.reference : w.mean;
    add_bit(reference, n, bit.inverse >= 0 ? 0.5f : 1.0f, difference, w.code.word);
  }
  settle_gray({bits, static_cast<float>(axis.words_per_fringe), 2 * job.noise}, w.code, w.turn[0], w.modulation[0], n,
              w.x, w.doubt, w.differs);
  const float period = static_cast<float>(axis.fringes[0].period);
  for (int i = 0; i < n; ++i) w.x[i] *= period;
}

void settle_by_beats(const AxisPlan& axis, int n, Workspace& w) {
  std::fill_n(w.doubt, n, 0.0f);
  std::fill_n(w.differs, n, 0.0f);
  std::fill_n(w.sum, n, 0.0f);
  std::fill_n(w.other, n, 0.0f);
  bool start = true;
  for (const Wave& wave : axis.chain) {
    const float* minus = wave.b >= 0 ? w.turn[wave.b] : w.other;
    refine_wave(w.turn[wave.a], minus, static_cast<float>(wave.period), start, n, w.x, w.differs);
    start = false;
  }
  refine_wave(w.turn[0], w.other, static_cast<float>(axis.fringes[0].period), false, n, w.x, w.differs);
  double total = 0;
  for (const Fringe& fringe : axis.fringes) total += 1 / (fringe.period * fringe.period);
  for (std::size_t f = 0; f < axis.fringes.size(); ++f) {
    const double period = axis.fringes[f].period;
    add_fine_wave(w.turn[f], static_cast<float>(period), static_cast<float>(1 / (period * period) / total), 0.25f, w.x,
                  n, w.sum, w.differs);
  }
  std::copy_n(w.sum, n, w.x);
}

template <class T>
void settle_by_search(const Job<T>& job, const AxisPlan& axis, int u, int v, int n, Workspace& w) {
  const double first = axis.fringes[0].period;
  const int singles = std::min<int>(8, static_cast<int>(axis.singles.size()));
  for (int s = 0; s < singles; ++s) {
    const SingleImage& single = axis.singles[s];
    to_grey(job.images[single.image].row(v) + u, n, job.scale, w.difference[s]);
    for (int i = 0; i < n; ++i) w.difference[s][i] -= w.mean[i];
    argument_of_wave(w.turn[0], n, static_cast<float>(first / single.period),
                     static_cast<float>(single.shift / (2 * kPi)), w.cosine[s], w.sine[s]);
  }
  std::fill_n(w.best, n, 1e30f);
  std::fill_n(w.second, n, 1e30f);
  std::fill_n(w.order, n, 0.0f);
  for (int k = 0; k < axis.orders; ++k) {
    std::fill_n(w.residual, n, 0.0f);
    for (int s = 0; s < singles; ++s) {
      const auto& [cosine, sine] = axis.singles[s].turns[k];
      add_order_residual(w.difference[s], w.modulation[0], w.cosine[s], w.sine[s], cosine, sine, n, w.residual);
    }
    keep_best_order(w.residual, static_cast<float>(k), n, w.order, w.best, w.second);
  }
  // A further image differs from its prediction by its own noise and by that of mean and modulation (2/3 each of 3
  // steps): variance 2. The wrong order wins with five sigma only if its residual is 25 variances smaller.
  const float variance = 2 * job.noise * job.noise;
  for (int i = 0; i < n; ++i) {
    w.x[i] = (w.order[i] + w.turn[0][i]) * static_cast<float>(first);
    w.doubt[i] = w.second[i] - w.best[i] < 25 * variance ? 1.0f : 0.0f;
    w.differs[i] =
        w.best[i] > (static_cast<float>(singles) + 9.0f) * variance + 0.02f * w.modulation[0][i] * w.modulation[0][i]
            ? 1.0f
            : 0.0f;
  }
}

/// Decodes n pixels of one axis from (u, v) on.
template <class T>
void decode_lanes(const Job<T>& job, const AxisPlan& axis, bool first, int u, int v, int n, Workspace& w,
                  Decoded& out) {
  std::fill_n(w.saturated, n, 0.0f);
  const std::size_t fringes = axis.chain.empty() ? 1 : axis.fringes.size();
  for (std::size_t f = 0; f < fringes; ++f) {
    fit_fringe(job, axis.fringes[f], u, v, n, w.phasor);
    turn_and_modulation(w.phasor, n, w.turn[f], w.modulation[f]);
    if (f == 0) std::copy_n(w.phasor.mean, n, w.mean);
    for (int i = 0; i < n; ++i) {
      w.saturated[i] = std::max(w.saturated[i], w.phasor.saturated[i]);
      if (f > 0) w.modulation[0][i] = std::min(w.modulation[0][i], w.modulation[f][i]);
    }
  }
  if (!axis.bits.empty())
    settle_by_code(job, axis, u, v, n, w);
  else if (!axis.chain.empty())
    settle_by_beats(axis, n, w);
  else
    settle_by_search(job, axis, u, v, n, w);

  finish(w.x, w.doubt, w.differs, w.modulation[0], w.saturated, w.mean, job.dark, n,
         (axis.axis == PatternAxis::column ? out.column : out.row).row(v) + u, out.invalid_reason.row(v) + u,
         first ? out.modulation.row(v) + u : nullptr, out.brightness.row(v) + u);
}

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

template <class T>
Decoded decode_images(const FrameStack& frames, const std::vector<Image<T>>& images, const DecodePlan& plan,
                      const DecodeOptions& options) {
  const double full = options.full_scale > 0 ? options.full_scale : std::numeric_limits<T>::max();
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
