#pragma once

#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "tribin/camera/camera.hpp"

namespace tribin::cli {

/// The options of a command that takes a scan from FRAMES_DIR, sim:CELL.toml or genicam[:ID].
struct SourceArguments {
  std::string source, frames_file;
  std::string taken, flange, flange_time;         ///< of hand-held cameras
  std::string level = "easy";                     ///< sim
  std::uint64_t seed = 1;                         ///< sim
  bool rendered = false;                          ///< sim
  std::string patterns, trigger, line = "Line1";  ///< genicam
  double exposure_ms = 0, timeout_s = 2;          ///< genicam
  int packet_size = 0, retries = 3;               ///< genicam
  bool no_packet_socket = false;                  ///< genicam
};

void add_source_arguments(CLI::App* command, SourceArguments& arguments, Context& context);

/// The same of a command that looks again and again: SOURCE may be left out (genicam) or be a scan file, with the rig
/// and the unit that go with them. \param each  what a look is for: "cycle", "request"
void add_live_source_arguments(CLI::App* command, SourceArguments& arguments, std::string& calibration,
                               std::string& scan_unit, const std::string& each, Context& context);

/// Opens the camera. \throws Error bad_option, naming the package, where its component is not built in.
std::unique_ptr<Camera> open_source(const SourceArguments& arguments);

/// --taken, --base-from-flange and --flange-time, where they are given, over what the shot says itself.
/// \throws Error bad_option where a pose is given and nobody knows the time.
void apply_taken(const SourceArguments& arguments, Shot& shot);

}  // namespace tribin::cli
