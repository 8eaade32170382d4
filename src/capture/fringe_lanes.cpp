#include "capture/fringe_lanes.hpp"

#include <cmath>
#include <limits>

#include "tribin/core/vector_levels.hpp"
#include "tribin/scan/scan.hpp"

// Straight loops over lanes, without branches, calls or sums across lanes: each is one vector loop at each SIMD level,
// and a lane does the same operations in the same order at all of them.

namespace tribin::capture_detail {
namespace {

template <class T>
[[gnu::always_inline]] inline void add_phase(const T* __restrict in, int n, float scale, float limit, PhaseWeights w,
                                             Phasor& out) {
  float* __restrict mean = out.mean;
  float* __restrict cosine = out.cosine;
  float* __restrict sine = out.sine;
  float* __restrict square = out.square;
  float* __restrict saturated = out.saturated;
  for (int x = 0; x < n; ++x) {
    const float v = static_cast<float>(in[x]) * scale;
    mean[x] += w.mean * v;
    cosine[x] += w.cosine * v;
    sine[x] += w.sine * v;
    square[x] += v * v;
    saturated[x] += v >= limit ? 1.0f : 0.0f;
  }
}

template <class T>
[[gnu::always_inline]] inline void convert(const T* __restrict in, int n, float scale, float* __restrict out) {
  for (int x = 0; x < n; ++x) out[x] = static_cast<float>(in[x]) * scale;
}

/// floor for |v| < 2^31, as a conversion and a correction: vectors have it at each level, std::floor has not.
[[gnu::always_inline]] inline float floored(float v) {
  const float whole = static_cast<float>(static_cast<std::int32_t>(v));
  return whole - (whole > v ? 1.0f : 0.0f);
}

/// atan2(y, x) / 2 pi in [0, 1). Octant reduction and an odd polynomial of degree 11; error < 2e-6 turns.
[[gnu::always_inline]] inline float turn_of(float y, float x) {
  const float ax = x < 0 ? -x : x, ay = y < 0 ? -y : y;
  const float large = ax > ay ? ax : ay, small = ax > ay ? ay : ax;
  const float a = small / (large > 1e-20f ? large : 1e-20f), s = a * a;
  // Hastings minimax polynomial for arctan on [0, 1] (1955; Abramowitz and Stegun 4.4.49 is its neighbour), in turns.
  float r = -0.0117212f;
  r = r * s + 0.05265332f;
  r = r * s - 0.11643287f;
  r = r * s + 0.19354346f;
  r = r * s - 0.33262347f;
  r = r * s + 0.99997726f;
  r = r * a * 0.15915494f;
  const float octant = ay > ax ? 0.25f - r : r;
  const float half = x < 0 ? 0.5f - octant : octant;
  const float full = y < 0 ? 1.0f - half : half;
  return full >= 1.0f ? 0.0f : full;
}

}  // namespace

TRIBIN_VECTOR_LEVELS void add_phase_image(const std::uint8_t* in, int n, float scale, float limit, PhaseWeights w,
                                          Phasor& out) {
  add_phase(in, n, scale, limit, w, out);
}
TRIBIN_VECTOR_LEVELS void add_phase_image(const std::uint16_t* in, int n, float scale, float limit, PhaseWeights w,
                                          Phasor& out) {
  add_phase(in, n, scale, limit, w, out);
}
TRIBIN_VECTOR_LEVELS void to_grey(const std::uint8_t* in, int n, float scale, float* out) {
  convert(in, n, scale, out);
}
TRIBIN_VECTOR_LEVELS void to_grey(const std::uint16_t* in, int n, float scale, float* out) {
  convert(in, n, scale, out);
}

TRIBIN_VECTOR_LEVELS void turn_and_modulation(const Phasor& in, int n, float* __restrict turn,
                                              float* __restrict modulation) {
  for (int x = 0; x < n; ++x) {
    turn[x] = turn_of(in.sine[x], in.cosine[x]);
    modulation[x] = std::sqrt(in.sine[x] * in.sine[x] + in.cosine[x] * in.cosine[x]);
  }
}

TRIBIN_VECTOR_LEVELS void add_bit(const float* __restrict reference, int n, float factor, float* __restrict difference,
                                  std::int32_t* __restrict word) {
  for (int x = 0; x < n; ++x) {
    const float d = (difference[x] - reference[x]) * factor;
    difference[x] = d;
    const std::int32_t bit = d > 0 ? 1 : 0;
    word[x] = (word[x] << 1) | ((word[x] & 1) ^ bit);
  }
}

TRIBIN_VECTOR_LEVELS void settle_gray(const GraySettings& p, const GrayLanes& code, const float* __restrict turn,
                                      const float* __restrict modulation, int n, float* __restrict x,
                                      float* __restrict doubt, float* __restrict differs) {
  const float words = p.words_per_fringe;
  const std::int32_t* __restrict word = code.word;
  alignas(64) float below[kLanes], above[kLanes];
  for (int i = 0; i < n; ++i) below[i] = above[i] = modulation[i], doubt[i] = 0;  // settled bits: at the code's ends
  if (words == 1) {
    // How near its threshold the bit is that changes at the fringe's lower and at its upper border.
    for (int b = 0; b < p.bits; ++b) {
      const std::int32_t mask = 1 << b;
      const float* __restrict d = code.difference[b];
      for (int i = 0; i < n; ++i) {
        const float size = d[i] < 0 ? -d[i] : d[i];
        const std::int32_t w = word[i], next = w + 1;
        below[i] = (w & -w) == mask ? size : below[i];
        above[i] = (next & -next) == mask ? size : above[i];
      }
    }
  }
  for (int i = 0; i < n; ++i) {
    const float w = static_cast<float>(word[i]), u = turn[i];
    // Half as near: a bit on its edge against one that is settled; at equal distance the code stands.
    const bool late = (u < 0.25f) & (above[i] < 0.5f * below[i]), early = (u > 0.75f) & (below[i] < 0.5f * above[i]);
    const float moved = w + (late ? 1.0f : 0.0f) - (early ? 1.0f : 0.0f);
    const float finer = floored((w + 0.5f) / words - u + 0.5f);
    x[i] = (words == 1 ? moved : finer) + u;
    const float off = x[i] * words - (w + 0.5f);
    differs[i] = (off < 0 ? -off : off) > 0.85f ? 1.0f : 0.0f;  // half a word and a third of the next
  }
  // The bit whose edge is near may be anything; any other one must be settled.
  alignas(64) std::int32_t allowed[kLanes];
  for (int i = 0; i < n; ++i) {
    const float place = x[i] * words, edge = floored(place + 0.5f), off = place - edge;
    const std::int32_t e = static_cast<std::int32_t>(edge), bit = e & -e;
    allowed[i] = (off < 0 ? -off : off) < 0.35f ? bit : 0;
  }
  for (int b = 0; b < p.bits; ++b) {
    const std::int32_t mask = 1 << b;
    const float* __restrict d = code.difference[b];
    for (int i = 0; i < n; ++i) {
      const float size = d[i] < 0 ? -d[i] : d[i];
      doubt[i] += (size < p.weak) & (allowed[i] != mask) ? 1.0f : 0.0f;
    }
  }
}

TRIBIN_VECTOR_LEVELS void refine_wave(const float* __restrict turn_a, const float* __restrict turn_b, float period,
                                      bool start, int n, float* __restrict x, float* __restrict differs) {
  for (int i = 0; i < n; ++i) {
    float turn = turn_a[i] - turn_b[i];
    turn += turn < 0 ? 1.0f : 0.0f;
    const float begun = turn > 0.9f ? turn - 1.0f : turn;  // noise about X = 0; sets leave the last fifth free
    const float before = start ? begun : x[i] / period;
    const float order = floored(before - turn + 0.5f), off = before - turn - order;
    x[i] = (order + turn) * period;
    differs[i] = (off < 0 ? -off : off) > 0.35f ? 1.0f : differs[i];
  }
}

TRIBIN_VECTOR_LEVELS void add_fine_wave(const float* __restrict turn, float period, float weight, float tolerance,
                                        const float* __restrict x, int n, float* __restrict sum,
                                        float* __restrict differs) {
  for (int i = 0; i < n; ++i) {
    const float before = x[i] / period;
    const float order = floored(before - turn[i] + 0.5f), off = before - turn[i] - order;
    sum[i] += weight * (order + turn[i]) * period;
    differs[i] = (off < 0 ? -off : off) > tolerance ? 1.0f : differs[i];
  }
}

TRIBIN_VECTOR_LEVELS void argument_of_wave(const float* __restrict turn, int n, float ratio, float shift,
                                           float* __restrict cosine, float* __restrict sine) {
  for (int i = 0; i < n; ++i) {
    const float t = turn[i] * ratio + shift, f = t - floored(t + 0.5f);  // in [-0.5, 0.5]
    // Of a quarter of the angle, in [-pi/4, pi/4], by Taylor; then doubled twice. Error < 1e-5, far below image noise.
    const float q = f * 1.57079633f, s2 = q * q;
    float s = q * (1 - s2 * (1.0f / 6 - s2 * (1.0f / 120 - s2 * (1.0f / 5040))));
    float c = 1 - s2 * (0.5f - s2 * (1.0f / 24 - s2 * (1.0f / 720 - s2 * (1.0f / 40320))));
    const float s4 = 2 * s * c, c4 = c * c - s * s;
    sine[i] = 2 * s4 * c4;
    cosine[i] = c4 * c4 - s4 * s4;
  }
}

TRIBIN_VECTOR_LEVELS void add_order_residual(const float* __restrict difference, const float* __restrict modulation,
                                             const float* __restrict cosine, const float* __restrict sine, float cos_b,
                                             float sin_b, int n, float* __restrict residual) {
  for (int i = 0; i < n; ++i) {
    const float r = difference[i] - modulation[i] * (cosine[i] * cos_b - sine[i] * sin_b);
    residual[i] += r * r;
  }
}

TRIBIN_VECTOR_LEVELS void keep_best_order(const float* __restrict residual, float order, int n,
                                          float* __restrict best_order, float* __restrict best,
                                          float* __restrict second) {
  for (int i = 0; i < n; ++i) {
    const float r = residual[i], b = best[i], s = second[i];
    const float other = r < b ? b : r;
    second[i] = other < s ? other : s;
    best_order[i] = r < b ? order : best_order[i];
    best[i] = r < b ? r : b;
  }
}

TRIBIN_VECTOR_LEVELS void finish(const float* __restrict x, const float* __restrict doubt,
                                 const float* __restrict differs, const float* __restrict modulation,
                                 const float* __restrict saturated, const float* __restrict mean, float dark, int n,
                                 float* __restrict column, std::uint8_t* __restrict reason,
                                 std::uint8_t* __restrict modulation_out, std::uint8_t* __restrict brightness_out) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  constexpr std::int32_t kInconsistent = static_cast<std::int32_t>(Invalid::order_inconsistent),
                         kUncertain = static_cast<std::int32_t>(Invalid::uncertain_bit),
                         kDark = static_cast<std::int32_t>(Invalid::dark),
                         kSaturated = static_cast<std::int32_t>(Invalid::saturated);
  alignas(64) std::int32_t why[kLanes];
  for (int i = 0; i < n; ++i) {
    std::int32_t w = differs[i] > 0 ? kInconsistent : 0;
    w = doubt[i] > 0 ? kUncertain : w;
    w = modulation[i] < dark ? kDark : w;
    w = saturated[i] > 0 ? kSaturated : w;
    why[i] = w;
    const float place = x[i] - 0.5f;
    column[i] = w == 0 ? place : kNaN;
  }
  if (!modulation_out) return;
  for (int i = 0; i < n; ++i) reason[i] = static_cast<std::uint8_t>(why[i]);
  for (int i = 0; i < n; ++i) {
    const std::int32_t m = static_cast<std::int32_t>(modulation[i] + 0.5f);
    const std::int32_t b = static_cast<std::int32_t>(mean[i] + 0.5f), positive = b > 0 ? b : 0;
    modulation_out[i] = static_cast<std::uint8_t>(m < 255 ? m : 255);
    brightness_out[i] = static_cast<std::uint8_t>(positive < 255 ? positive : 255);
  }
}

}  // namespace tribin::capture_detail
