#pragma once

#include <string>

#include "tribin/core/geometry.hpp"

namespace tribin::sim {

/// Difficulty of simulated scenes, fixed for good, the same for tables and bins.
enum class Level { easy, dense, hard };

/// \throws Error bad_option for anything but easy, dense, hard.
Level level_of(const std::string& name);

struct LevelSettings {
  const char* name = "";
  int fewest_parts = 0, most_parts = 0;
  int fewest_classes = 0, most_classes = 0;
  double image_noise = 0;                    ///< sd of a grey level
  double correlation_px = 0;                 ///< of the depth noise
  double systematic = 0;                     ///< largest relative error of depth
  double highlight = 0;                      ///< StructuredLight::highlight
  double mirror_share = 0;                   ///< StructuredLight::mirror_share
  double max_tilt = 0;                       ///< of the camera [rad]
  double lost_low = 0, lost_high = 0;        ///< share of pixels lost
  int fewest_foreign = 0, most_foreign = 0;  ///< objects in the bin that are no parts
};

const LevelSettings& settings_of(Level level);

}  // namespace tribin::sim
