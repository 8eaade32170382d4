#include <algorithm>
#include <set>

#include "commands.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/part_cache.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin::cli {

CLI::App* add_command(CLI::App& app, Context& context, const std::string& name, const std::string& what,
                      const std::string& example) {
  CLI::App* command = app.add_subcommand(name, what);
  command->footer("Example:\n  " + example);
  command->add_flag("-q,--quiet", context.quiet, "No warnings, no progress");
  command->add_flag("-v,--verbose", context.verbose, "Say more on stderr");
  command->add_option("--threads", context.threads, "Threads to use, 0 = all cores; never changes a result")
      ->check(CLI::Range(0, 1024))
      ->type_name("N");
  command->add_flag("--expert", context.expert, "Allow what is otherwise derived to be set (see docs/cli.md)");
  return command;
}

void only_experts(CLI::Option* option, Context& context) {
  const std::string name = option->get_name();  // before it leaves the help's groups: then it has no name to show
  option->group("");
  option->check(CLI::Validator(
      [&context, name](std::string&) {
        return context.expert ? std::string() : name + " stands behind --expert; give --expert first";
      },
      ""));
}

std::vector<PartArgument> part_arguments(const std::vector<std::string>& arguments) {
  std::vector<PartArgument> out;
  std::set<std::string> names;
  for (const std::string& argument : arguments) {
    PartArgument part{"", argument};
    const std::size_t equals = argument.find('=');
    if (equals != std::string::npos && argument.find('/') > equals) {  // a '=' in a folder's name is no NAME=
      part = {argument.substr(0, equals), argument.substr(equals + 1)};
      if (part.name.empty()) throw Error(ErrorCode::bad_option, "--part " + argument + ": no name before the '='");
    }
    if (part.name.empty()) part.name = part.file.stem().string();
    if (!names.insert(part.name).second)
      throw Error(ErrorCode::bad_option, "--part " + argument + ": two parts are named '" + part.name +
                                             "'; give one another name by --part NAME=CAD");
    out.push_back(part);
  }
  return out;
}

void refuse_without_simulation() {
  throw Error(ErrorCode::bad_option,
              "the simulated camera is not built in; install libembree-dev libbullet-dev and build again");
}

void add_any_scan(CLI::App* command, std::string& scan, std::string& camera, std::string& unit) {
  command
      ->add_option("SCAN", scan, "Scan: PCD, PLY, depth PNG or TIFF with camera.json, NPY; loose points too, also XYZ")
      ->required();
  command->add_option("--camera", camera, "Camera file of a depth image")->type_name("FILE");
  command->add_option("--scan-unit,--depth-unit", unit, "Unit of clouds and of depth images of floats: mm, m, auto")
      ->type_name("U");
}

void add_no_cache(CLI::App* command, bool& no_cache) {
  command->add_flag("--no-cache", no_cache, "Compile the CAD anew: no kept part is used, and none is kept");
}

void add_free_spin(CLI::App* command, std::vector<std::string>& names) {
  command
      ->add_option(
          "--free-spin", names,
          "Name of a part whose turn about its nearly round axis makes no difference, a toothed wheel for one; "
          "repeat it for more")
      ->type_name("NAME")
      ->allow_extra_args(false);
}

void declare_free_spins(const std::vector<std::string>& names, std::vector<Part>& parts) {
  for (const std::string& name : names) {
    const auto part = std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == name; });
    if (part == parts.end()) throw Error(ErrorCode::bad_option, "--free-spin " + name + ": no --part has that name");
    declare_free_spin(*part);
  }
}

std::vector<Part> read_parts(const std::vector<PartArgument>& arguments, const std::string& unit, bool no_cache) {
  PartReadOptions options;
  options.cad.unit = length_unit_from_name(unit);
  if (!no_cache) options.cache = part_cache_folder();
  std::vector<Part> parts;
  for (const PartArgument& argument : arguments) {
    options.name = argument.name;
    parts.push_back(read_part(argument.file, options));
    for (const std::string& warning : parts.back().warnings)
      log(LogLevel::warning, argument.file.filename().string() + ": " + warning);
  }
  return parts;
}

Scan read_scan_logged(const std::filesystem::path& file, const std::string& camera, const std::string& unit) {
  Scan scan = read_scan(file, {.camera_file = camera, .unit = length_unit_from_name(unit)});
  for (const std::string& warning : scan.warnings) log(LogLevel::warning, file.filename().string() + ": " + warning);
  return scan;
}

ScanOrPoints read_scan_or_points_logged(const std::filesystem::path& file, const std::string& camera,
                                        const std::string& unit) {
  ScanOrPoints input = read_scan_or_points(file, {.camera_file = camera, .unit = length_unit_from_name(unit)});
  std::visit(
      [&](const auto& read) {
        for (const std::string& warning : read.warnings)
          log(LogLevel::warning, file.filename().string() + ": " + warning);
      },
      input);
  return input;
}

Surfels surfels_of(const ScanOrPoints& input, const SurfelOptions& options) {
  if (const auto* scan = std::get_if<Scan>(&input)) return surfels_from_scan(*scan, options);
  return surfels_from_points(std::get<PointSet>(input), options);
}

}  // namespace tribin::cli
