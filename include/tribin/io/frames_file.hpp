#pragma once

#include <filesystem>
#include <vector>

#include "tribin/capture/decode.hpp"

namespace tribin {

/// Reads the frames of a structured-light scan: the images that frames.json names, 8- or 16-bit grey PNG.
///
/// frames.json: {"cameras": [{"camera": name, "patterns": [{"file", "kind": "phase|gray|gray_inverse|white|black",
/// "axis": "column|row", "period_px", "shift_deg", "bit", "exposure_ms"}], "full_scale"}], "projector": {"width",
/// "height"}}. full_scale is the saturated value of cameras of 10 or 12 bit; the projector only calibration needs. A
/// phase image is brightest where 360 X / period_px + shift_deg = 0, X counted from the edge of projector pixel 0. A
/// Gray image is bright where floor(X / period_px) mod 4 is 1 or 2: period_px is the width of the words that the bits
/// down to this one make. Gray images may leave period_px out and give `bit` (0 = coarsest): then the finest bit's
/// words are as wide as a fringe. \param folder       of the images; `file` is relative to it. \param frames_file
/// empty: frames.json in the folder. \throws Error bad_input (file, place, seen, wanted).
std::vector<FrameStack> read_frames(const std::filesystem::path& folder, const std::filesystem::path& frames_file = {});

/// The patterns of a frames.json with one camera, without its images: what a camera is to take.
/// \param path  the file, or its folder. \throws Error bad_input (file, place, seen, wanted).
FrameStack read_sequence(const std::filesystem::path& path);

/// Writes a pattern set: a PNG for each pattern, and a frames.json for a camera `camera` that records them under the
/// same names. \throws Error bad_input when the folder cannot be written.
void write_patterns(const std::filesystem::path& folder, const std::vector<Pattern>& patterns, int width, int height,
                    double gamma = 1, const std::vector<std::string>& cameras = {"camera"});

/// Writes what cameras took, one stack each, as PNG with the patterns' names, and the frames.json that read_frames
/// reads. \throws Error bad_input when the folder cannot be written.
void write_frames(const std::filesystem::path& folder, const std::vector<FrameStack>& frames);

}  // namespace tribin
