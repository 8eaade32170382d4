#pragma once

#include <string>

#include "commands.hpp"
#include "tribin/report/rig_calibration_json.hpp"

namespace tribin::cli {

/// The options that calibrate camera, projector and rig share.
struct CalibrationArguments {
  std::string kind = "chessboard", size, dictionary = "4X4_50", out, json, report;
  double pitch_mm = 0, marker_mm = 0;
};

void add_calibration_arguments(CLI::App* command, CalibrationArguments& arguments);
/// \throws Error bad_option, naming the first bad one.
Board board_of(const CalibrationArguments& arguments);
/// Writes the rig and the result, prints a summary and logs the advice. \return the exit code.
int finish_calibration(const CalibrationArguments& arguments, const RigCalibrationReport& report,
                       const Context& context);
/// \throws Error bad_option, naming the package.
[[noreturn]] void refuse_without_calibration();

}  // namespace tribin::cli
