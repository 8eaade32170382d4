#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/decode_plan.hpp"
#include "capture/fringe_lanes.hpp"
#include "tribin/capture/decode.hpp"
#include "tribin/core/geometry.hpp"

// How one stretch of a row is decoded, for pixels of 8 and 16 bit.

namespace tribin::capture_detail {

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

inline void settle_by_beats(const AxisPlan& axis, int n, Workspace& w) {
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

}  // namespace tribin::capture_detail
