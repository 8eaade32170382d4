#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tribin/io/scan_files.hpp"
#include "tribin/part/part.hpp"

namespace tribin::cli {

/// What all commands share.
struct Context {
  bool quiet = false;
  bool verbose = false;
  bool expert = false;               ///< --expert was given: the derived settings may be set by hand
  int threads = 0;                   ///< 0 = all cores
  std::vector<std::string> command;  ///< argv, for the report's "run it again"
  std::function<int()> run;          ///< set by the chosen command; returns the exit code
};

// Each command is one file: it declares its options and sets Context::run when it is chosen.
void add_locate(CLI::App& app, Context& context);
void add_segment(CLI::App& app, Context& context);
void add_normals(CLI::App& app, Context& context);
void add_part(CLI::App& app, Context& context);
void add_convert(CLI::App& app, Context& context);
void add_patterns(CLI::App& app, Context& context);
void add_scan(CLI::App& app, Context& context);
void add_simulate(CLI::App& app, Context& context);
void add_calibrate(CLI::App& app, Context& context);
void add_calibrate_camera(CLI::App& group, Context& context);
void add_calibrate_projector(CLI::App& group, Context& context);
void add_calibrate_rig(CLI::App& group, Context& context);
void add_calibrate_hand_eye(CLI::App& group, Context& context);
void add_calibrate_touch(CLI::App& group, Context& context);
void add_bop(CLI::App& app, Context& context);
void add_merge(CLI::App& app, Context& context);
void add_eval(CLI::App& app, Context& context);
void add_bench(CLI::App& app, Context& context);
void add_grasps(CLI::App& app, Context& context);
void add_pick(CLI::App& app, Context& context);
void add_robot_server(CLI::App& app, Context& context);
void add_simulate_controller(CLI::App& app, Context& context);

// Shared by the commands (inputs.cpp).

/// A subcommand with -q, -v, --threads, --expert and an example under its help.
CLI::App* add_command(CLI::App& app, Context& context, const std::string& name, const std::string& what,
                      const std::string& example);
/// An option that stands behind --expert: hidden and refused without it.
void only_experts(CLI::Option* option, Context& context);

struct PartArgument {
  std::string name;
  std::filesystem::path file;
};
/// Takes "[NAME=]CAD" apart; the name is the file's stem where none is given.
/// \throws Error bad_option for two equal names.
std::vector<PartArgument> part_arguments(const std::vector<std::string>& arguments);

/// For commands that simulate, where the simulated camera is not built in.
/// \throws Error bad_option, naming the package.
[[noreturn]] void refuse_without_simulation();

/// The arguments SCAN, --camera and --scan-unit of commands that take scans and loose points alike.
void add_any_scan(CLI::App* command, std::string& scan, std::string& camera, std::string& unit);

/// --no-cache, for commands that compile parts.
void add_no_cache(CLI::App* command, bool& no_cache);

/// --free-spin, for commands that look for parts.
void add_free_spin(CLI::App* command, std::vector<std::string>& names);
/// Declares it of the parts of these names. \throws Error bad_option for a name that no part has.
void declare_free_spins(const std::vector<std::string>& names, std::vector<Part>& parts);

/// Reads the parts and compiles those that the cache does not hold; their warnings go to the log.
std::vector<Part> read_parts(const std::vector<PartArgument>& arguments, const std::string& unit,
                             bool no_cache = false);

/// Reads an organized scan or loose points and logs the warnings.
ScanOrPoints read_scan_or_points_logged(const std::filesystem::path& file, const std::string& camera,
                                        const std::string& unit);
/// The surfels of either; the input must outlive them.
Surfels surfels_of(const ScanOrPoints& input, const SurfelOptions& options);

/// Reads an organized scan and logs its warnings.
Scan read_scan_logged(const std::filesystem::path& scan, const std::string& camera, const std::string& unit);

}  // namespace tribin::cli
