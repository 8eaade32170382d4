#include <cstdio>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/frames_file.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string out, code = "gray", size = "1280x800", axes = "columns";
  std::vector<std::string> cameras{"camera"};
  double period = 16, gamma = 1;
  int steps = 4;
};

PatternCode code_of(const std::string& name) {
  if (name == "gray") return PatternCode::gray;
  if (name == "heterodyne") return PatternCode::heterodyne;
  if (name == "micro") return PatternCode::micro;
  throw Error(ErrorCode::bad_option, "--set " + name + ": wanted gray, heterodyne or micro");
}

int run(const Options& options, const Context&) {
  PatternOptions set;
  set.code = code_of(options.code);
  char cross = 0, rest = 0;
  if (std::sscanf(options.size.c_str(), "%d%c%d%c", &set.width, &cross, &set.height, &rest) != 3 || cross != 'x')
    throw Error(ErrorCode::bad_option, "--size " + options.size + ": wanted WIDTHxHEIGHT in pixels, as 1280x800");
  if (options.axes != "columns" && options.axes != "rows" && options.axes != "both")
    throw Error(ErrorCode::bad_option, "--axes " + options.axes + ": wanted columns, rows or both");
  set.columns = options.axes != "rows";
  set.rows = options.axes != "columns";
  set.period_px = options.period;
  set.steps = options.steps;
  const std::vector<Pattern> patterns = make_patterns(set);
  StagedOutput staged(options.out);
  write_patterns(staged.path(), patterns, set.width, set.height, options.gamma, options.cameras);
  staged.publish();
  std::printf("%s: %zu patterns of %d x %d\n", options.out.c_str(), patterns.size(), set.width, set.height);
  return 0;
}

}  // namespace

void add_patterns(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "patterns", "Draw a structured-light pattern set for a projector",
                                  "tribin patterns --size 1280x800 --set gray -o patterns");
  command->add_option("-o", options->out, "Folder: a PNG for each pattern, and the frames.json of their recording")
      ->required()
      ->type_name("DIR");
  command->add_option("--size", options->size, "Of the projector [px]")->type_name("WxH");
  command->add_option("--set", options->code, "gray, heterodyne, micro (see docs/capture.md)")->type_name("S");
  command->add_option("--period-px", options->period, "Finest fringe, 4..256")->type_name("PX");
  command->add_option("--steps", options->steps, "Of the phase shift, 3..8")->type_name("N");
  command->add_option("--axes", options->axes, "columns, rows, both")->type_name("A");
  command->add_option("--gamma", options->gamma, "Of the projector: patterns are written for its light to be linear")
      ->check(CLI::Range(0.2, 5.0))
      ->type_name("G");
  command->add_option("--camera", options->cameras, "Names of the cameras that record it, as in rig.json")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
