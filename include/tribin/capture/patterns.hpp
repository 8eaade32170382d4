#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/core/image.hpp"

namespace tribin {

enum class PatternKind : std::uint8_t { phase, gray, gray_inverse, white, black };
/// Along which projector coordinate a pattern changes: `column` patterns are vertical stripes.
enum class PatternAxis : std::uint8_t { column, row };

std::string_view name_of(PatternKind kind);
std::string_view name_of(PatternAxis axis);

/// One image of a structured-light set. X is the projector coordinate from the left (upper) edge of its first pixel,
/// so that the middle of pixel i is X = i + 0.5. Each pattern says by itself what it shows:
///   phase  (1 + cos(2 pi X / period_px + shift_rad)) / 2
///   gray   1 where floor(X / period_px) mod 4 is 1 or 2: one bit of the reflected code, whose words of all bits down
///   to
///          this one are period_px wide; gray_inverse is its complement
struct Pattern {
  PatternKind kind = PatternKind::white;
  PatternAxis axis = PatternAxis::column;
  double period_px = 0;    ///< see above; > 0 for phase and gray
  double shift_rad = 0;    ///< phase only
  int bit = -1;            ///< gray only: 0 = coarsest; for people, the decoder goes by period_px
  double exposure_ms = 0;  ///< > 0 where a set is taken with several exposures, each of them complete
};

/// What a pattern sends out at X, in [0, 1], before the projector's own blur.
double pattern_value(const Pattern& pattern, double x);

/// The picture to be projected, 8 bit. \param gamma  of the projector: a value I is written as 255 I^(1/gamma).
Image<std::uint8_t> draw_pattern(const Pattern& pattern, int width, int height, double gamma = 1);

enum class PatternCode {
  gray,        ///< Gray code + phase, with the complementary half-stripe word: robust, bright or dark parts
  heterodyne,  ///< 3 or 4 close fringe frequencies, each of all steps: no wide stripes, so little inter-reflection
  micro,       ///< micro phase shifting: as heterodyne, but one image for each further frequency: fewest images
};

struct PatternOptions {
  PatternCode code = PatternCode::gray;
  int width = 1280;  ///< of the projector [px], 8..16384
  int height = 800;  ///< of the projector [px], 8..16384
  double period_px =
      16;               ///< finest fringe [px]: 4..256; gray code wants it even, so that half stripes are whole pixels
  int steps = 4;        ///< of the phase shift, 3..8
  bool columns = true;  ///< vertical stripes, that measure
  bool rows = false;    ///< horizontal stripes too: they check the calibration
};

/// The patterns of a set in the order in which they are projected; white and black come first.
/// \throws Error bad_option, naming the option.
/// \source gray: Zhang, Optics and Lasers in Engineering 50 (2012) 149, with the half-stripe word (complementary Gray
///         code) of Sun et al. 2006; heterodyne: Towers et al. 2005, frequencies N, N - r^0, N - r^1, ... ;
///         micro: Gupta and Nayar, CVPR 2012.
std::vector<Pattern> make_patterns(const PatternOptions& options);

/// File name of a pattern of a set: "07_column_gray_3.png".
std::string pattern_file_name(const std::vector<Pattern>& patterns, std::size_t index);

}  // namespace tribin
