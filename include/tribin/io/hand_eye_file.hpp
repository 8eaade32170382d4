#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tribin/capture/hand_eye.hpp"
#include "tribin/capture/touch.hpp"

namespace tribin {

/// What a pose file says: the pairs, and the ids that have no partner. The format stands in docs/calibration.md.
struct HandEyeFile {
  std::vector<HandEyePair> pairs;    ///< in the order of the robot poses
  std::optional<CameraMount> mount;  ///< where the file says it
  HandEyeTarget target = HandEyeTarget::board;
  HandEyeNoise noise;                    ///< defaults where the file says nothing
  std::vector<std::string> robot_only;   ///< ids of robot poses without a camera pose
  std::vector<std::string> camera_only;  ///< ids of camera poses without a robot pose
};

/// Reads robot poses in their maker's convention and camera poses, and pairs them by id.
/// \throws Error  bad_input, naming the file, the entry, what was seen and what was wanted; out_of_range where the
///                positions look like metres.
HandEyeFile read_hand_eye_file(const std::filesystem::path& path);

/// Predicted and touched points; the day of the test where the file says it ("2026-11-22").
struct TouchFile {
  std::vector<TouchedPoint> points;
  std::optional<std::string> date;
};

/// \throws Error bad_input, naming the file, the entry, what was seen and what was wanted.
TouchFile read_touch_file(const std::filesystem::path& path);

/// Whether the text is a day of the calendar, YYYY-MM-DD.
bool is_date(const std::string& text);

}  // namespace tribin
