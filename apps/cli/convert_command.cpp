#include <cstdio>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/convert.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string in, out, camera, unit = "auto";
};

int run(const Options& options, const Context&) {
  const LengthUnit unit = length_unit_from_name(options.unit);
  StagedOutput staged(options.out);
  const Converted done = convert(options.in, staged.path(),
                                 {.scan = {.camera_file = options.camera, .unit = unit}, .cad = {.unit = unit}});
  staged.publish();
  for (const std::string& warning : done.warnings) log(LogLevel::warning, warning);
  std::printf("%s: %s of %zu points", options.out.c_str(), done.kind.c_str(), done.points);
  if (done.triangles > 0) std::printf(", %zu triangles", done.triangles);
  std::printf("\n");
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "convert", "Turn a scan or CAD file into another format",
                                  "tribin convert pulley.step pulley.dxf");
  command->add_option("IN", options->in, "Any readable scan or CAD file")->required();
  command->add_option("OUT", options->out, "The extension says the format; lengths are written in mm")->required();
  command->add_option("--camera", options->camera, "Camera file of a depth image")->type_name("FILE");
  command->add_option("--unit", options->unit, "Unit of an input that names none: mm, cm, m, inch, auto")
      ->type_name("U");
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
