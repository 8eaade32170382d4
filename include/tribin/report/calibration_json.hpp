#pragma once

#include <string>
#include <vector>

#include "tribin/finder/finder.hpp"
#include "tribin/io/hand_eye_file.hpp"

namespace tribin {

/// Advice and faults in words, for the log and the result: swapped pairs, outliers, parallel axes, noise.
std::vector<Warning> hand_eye_warnings(const HandEyeFile& file, const HandEye& result);
std::vector<Warning> touch_warnings(const TouchResult& result);

/// The result of `tribin calibrate hand-eye` (schema/hand_eye.schema.json).
std::string hand_eye_json(const HandEyeFile& file, CameraMount mount, const HandEye& result);

/// The result of `tribin calibrate touch` (schema/touch.schema.json).
/// \param date  the day of the test, YYYY-MM-DD: the caller's, so that the same input gives the same bytes.
std::string touch_json(const TouchFile& file, const std::string& date, const TouchResult& result);

}  // namespace tribin
