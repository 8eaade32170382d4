#pragma once

#include <cstdint>

namespace tribin::capture_detail {

/// Pixels of a row that are worked on at a time: their buffers stay in the first-level cache.
inline constexpr int kLanes = 512;

/// Phasor of one fringe period, summed over its images.
struct Phasor {
  alignas(64) float mean[kLanes], cosine[kLanes], sine[kLanes], square[kLanes], saturated[kLanes];
};

/// Weights of one phase image in the least-squares fit of mean + cosine cos(shift) - sine sin(shift).
struct PhaseWeights {
  float mean = 0, cosine = 0, sine = 0;
};

/// Adds n pixels of a phase image: `scale` turns values into grey levels, `limit` is where they count as saturated.
void add_phase_image(const std::uint8_t* in, int n, float scale, float limit, PhaseWeights weights, Phasor& out);
void add_phase_image(const std::uint16_t* in, int n, float scale, float limit, PhaseWeights weights, Phasor& out);

/// Turn in [0, 1) and modulation of a phasor.
void turn_and_modulation(const Phasor& in, int n, float* turn, float* modulation);

/// out = scale * in.
void to_grey(const std::uint8_t* in, int n, float scale, float* out);
void to_grey(const std::uint16_t* in, int n, float scale, float* out);

/// Takes one code bit: difference -= reference (halved where an inverse image is the reference), and the reflected code
/// goes on as plain binary in `word`.
void add_bit(const float* reference, int n, float factor, float* difference, std::int32_t* word);

/// Code and phase become the order of the fringe.
struct GraySettings {
  int bits = 0;
  float words_per_fringe = 1;  ///< 1, 2, 4 ..
  float weak = 0;              ///< |difference| below it is an uncertain bit [grey levels]
};
struct GrayLanes {
  alignas(64) float difference[16][kLanes];  ///< of bit b, 0 = finest: signed distance to the threshold
  alignas(64) std::int32_t word[kLanes];
};
/// \param x       out: fringes, order + turn.
/// \param doubt   out: number of uncertain bits other than the one whose edge is near.
/// \param differs out: 1 where code and phase contradict each other.
void settle_gray(const GraySettings& settings, const GrayLanes& code, const float* turn, const float* modulation, int n,
                 float* x, float* doubt, float* differs);

/// One step from a coarse to a finer wave: x [px] keeps its order, takes the turn of the finer one; `differs` becomes 1
/// where they are more than 0.35 turns apart. With period_before <= 0 it starts x.
void refine_wave(const float* turn_a, const float* turn_b, float period, bool start, int n, float* x, float* differs);

/// Adds weight * (x settled by the wave turn, period) to sum; `differs` as above, at `tolerance` turns.
void add_fine_wave(const float* turn, float period, float weight, float tolerance, const float* x, int n, float* sum,
                   float* differs);

/// Micro phase shifting: cosine and sine of the argument that a further frequency has in fringe 0 of the first one.
/// \param ratio  periods of the further frequency in one of the first; \param shift  of its image [turns].
void argument_of_wave(const float* turn, int n, float ratio, float shift, float* cosine, float* sine);

/// Tries one order: residual += (difference - modulation * (cosine cos(b) - sine sin(b)))^2.
void add_order_residual(const float* difference, const float* modulation, const float* cosine, const float* sine,
                        float cos_b, float sin_b, int n, float* residual);

/// Keeps the best order, its residual and the second best residual.
void keep_best_order(const float* residual, float order, int n, float* best_order, float* best, float* second);

/// What is written of n pixels: x - 0.5 (X = 0.5 is the middle of pixel 0) or NaN, the reason, and, where they are not
/// null, modulation and brightness rounded to grey levels. Saturated goes before dark, dark before the code's doubts.
void finish(const float* x, const float* doubt, const float* differs, const float* modulation, const float* saturated,
            const float* mean, float dark, int n, float* column, std::uint8_t* reason, std::uint8_t* modulation_out,
            std::uint8_t* brightness_out);

}  // namespace tribin::capture_detail
