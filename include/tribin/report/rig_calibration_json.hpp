#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tribin/capture/calibrate_rig.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin {

/// A calibration and where it came from.
struct RigCalibrationReport {
  Board board;
  std::vector<std::string> ids;  ///< of the views
  std::vector<BoardObserver> observers;
  std::vector<std::string> not_found;  ///< pictures without the board
  RigCalibration result;
  std::optional<Rig> known = {};  ///< the rig to which a projector was added: its cameras are kept as they are
};

/// The rig as it is kept: the observers as cameras (those of a known rig stay), the one that is a projector apart.
Rig rig_of(const RigCalibrationReport& report);

/// What to mend, in words: outlying views, pictures without the board, parts of the pictures and tilts that are
/// missing, parameters that the views leave open.
std::vector<Warning> rig_calibration_warnings(const RigCalibrationReport& report);

/// The result of `tribin calibrate camera`, `projector` and `rig` (schema/calibration.schema.json).
std::string rig_calibration_json(const RigCalibrationReport& report);

/// Writes index.html: each device's picture with the boards' points and their residuals, what is uncertain where, the
/// views by their rms. One page, no network. \throws Error bad_option when the folder cannot be written.
void write_rig_calibration_report(const std::filesystem::path& folder, const RigCalibrationReport& report);

}  // namespace tribin
