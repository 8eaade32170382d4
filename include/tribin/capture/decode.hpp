#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tribin/capture/patterns.hpp"
#include "tribin/core/image.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin {

/// What one camera took of a pattern set: pattern i is in image i. One of the two lists is filled.
struct FrameStack {
  std::string camera;  ///< name in the rig
  std::vector<Pattern> patterns;
  std::vector<Image<std::uint8_t>> grey8;
  std::vector<Image<std::uint16_t>> grey16;
  std::vector<std::string> files;  ///< names for messages; may be empty
  double full_scale = 0;           ///< value that counts as saturated, 0 = 255 or 65535
  int projector_width = 0;         ///< of the patterns [px], 0 = not said
  int projector_height = 0;

  int width() const { return !grey8.empty() ? grey8[0].width : grey16.empty() ? 0 : grey16[0].width; }
  int height() const { return !grey8.empty() ? grey8[0].height : grey16.empty() ? 0 : grey16[0].height; }
};

/// Grey levels are those of 8 bit: 16-bit values are scaled by 255 / full_scale.
struct DecodeOptions {
  double image_noise = 0;     ///< sd of a pixel [grey levels], 0 = from how well the frames follow a sinusoid
  double min_modulation = 0;  ///< [grey levels], 0 = 5 sd of the modulation that image noise alone makes
  double full_scale = 0;      ///< camera value that counts as saturated; 0 = what the frames say
};

/// Where on the projector each camera pixel looks.
struct Decoded {
  Image<float> column;  ///< projector column [px, pixel centres at integers], NaN = none; empty if no such patterns
  Image<float> row;     ///< the same of rows
  Image<std::uint8_t> modulation;      ///< [grey levels], of the finest fringes of the columns (rows if alone)
  Image<std::uint8_t> invalid_reason;  ///< of Invalid, for the columns (rows if alone); rows may be lost beside it
  Image<std::uint8_t> brightness;      ///< mean of the phase images [grey levels]: a picture of the scene
  double image_noise = 0;              ///< that was used [grey levels]
  double column_noise = 0;             ///< sd of a column [px] at modulation 1: divide by the modulation
  double row_noise = 0;                ///< the same of rows
  std::vector<std::string> warnings;

  int width() const { return invalid_reason.width; }
  int height() const { return invalid_reason.height; }
};

/// Decodes the frames of one camera. Gray code + phase with or without the half-stripe word, heterodyne and micro phase
/// sets are told apart by the patterns themselves. Fringes of any steps and shifts; a pixel with saturated phase images
/// is solved from the others while three are left. Frames of several exposures are decoded each and merged.
///
/// Period jumps: with a word finer than the fringe, the order is the one whose edges lie farther from the phase.
/// Without it, a pixel near a fringe border may be counted on the wrong side; the code bit that changes at the true
/// border is near its threshold there, the one that changes at the other border is not, and that decides. The same
/// bytes for any number of threads and at any SIMD level. \throws Error bad_input, when the images differ in size or
/// the patterns do not make a set. \cost         16 images of 1.3 Mpx: see docs/capture.md.
Decoded decode(const FrameStack& frames, const DecodeOptions& options = {});

/// Merges what several exposures gave: weights by modulation squared, the longest that is not saturated counts most.
/// Where they differ by more than 5 sd the pixel is order_inconsistent.
Decoded merge_exposures(std::span<const Decoded> exposures);

}  // namespace tribin
