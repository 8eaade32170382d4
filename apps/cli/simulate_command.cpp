#include <cstdio>

#include "cell_view.hpp"
#include "commands.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/taken_file.hpp"
#ifdef TRIBIN_WITH_SIM
#include "tribin/sim/cell_view.hpp"
#include "tribin/sim/dataset.hpp"
#endif

namespace tribin::cli {
namespace {

struct Options {
  std::vector<std::string> parts;
  std::string cell, flange;
  std::string kind, level = "easy", out, unit = "mm";
  int scenes = 1;
  std::uint64_t seed = 1;
  double systematic = -1, scale_error = 0;
  bool frames = false;
};

#ifdef TRIBIN_WITH_SIM
int run(const Options& options, const Context& context) {
  sim::DatasetOptions dataset;
  const bool in_cell = !options.cell.empty();
  const std::string kind = !options.kind.empty() ? options.kind : in_cell ? "bin" : "table";
  dataset.kind = sim::scene_kind_of(kind);
  if (in_cell) {
    const WorkCell cell = read_work_cell_logged(options.cell);
    std::optional<Pose> base_from_flange;
    if (!options.flange.empty()) base_from_flange = robot_pose_from_text(options.flange);
    dataset.cell = sim::cell_view_of(cell, base_from_flange);
    if (options.parts.empty()) dataset.parts = meshes_of(cell);
  }
  dataset.level = sim::level_of(options.level);
  dataset.scenes = options.scenes;
  dataset.seed = options.seed;
  dataset.frames = options.frames;
  if (options.systematic >= 0) dataset.systematic = options.systematic;
  dataset.scale_error = options.scale_error;
  for (const PartArgument& part : part_arguments(options.parts)) {
    dataset.parts.push_back(read_cad(part.file, {.unit = length_unit_from_name(options.unit)}));
    dataset.parts.back().name = part.name;
  }
  {
    const RemovedOnSignal unfinished(sim::unfinished_scenes(options.out));
    Progress progress("Simulating", options.scenes, context.quiet);
    dataset.progress = [&](int done, int) { progress.done(done); };
    sim::simulate_dataset(dataset, options.out);
  }
  std::printf("%s: %d scene%s of kind %s, level %s\n", options.out.c_str(), options.scenes,
              options.scenes == 1 ? "" : "s", kind.c_str(), options.level.c_str());
  return 0;
}
#else
int run(const Options&, const Context&) { refuse_without_simulation(); }
#endif

}  // namespace

void add_simulate(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(
      app, context, "simulate", "Make scans of parts on a table or in a bin, with their truth, as a BOP data set",
      "tribin simulate --part pulley.step --part shaft.stl --kind bin --level dense -o scenes --scenes 10\n"
      "  tribin simulate examples/cells/bench_cell.toml -o scenes --scenes 10");
  command->add_option("CELL.toml", options->cell, "Work cell: its bin, camera and parts, in place of drawn ones")
      ->type_name("FILE");
  command
      ->add_option("--base-from-flange", options->flange,
                   "Where the robot holds the cell's camera, if it is on the flange: \"yaskawa 600 0 900 180 0 0\"")
      ->type_name("POSE");
  command->add_option("--part", options->parts, "CAD of a part; repeat it for more; with a cell: in place of its parts")
      ->type_name("[NAME=]CAD")
      ->allow_extra_args(false);
  command
      ->add_option(
          "--kind", options->kind,
          "table: side by side; bin: a heap made by physics (of a cell always); empty, foreign: a bin without parts")
      ->type_name("K");
  command->add_option("--level", options->level, "easy, dense, hard: parts, noise, tilt, lost pixels")->type_name("L");
  command->add_option("-o", options->out, "Folder of the data set; scenes that it holds are kept")
      ->required()
      ->type_name("DIR");
  command->add_option("--scenes", options->scenes, "How many")->check(CLI::Range(1, 1000000))->type_name("N");
  command->add_option("--seed", options->seed, "The same seed gives the same scenes")->type_name("S");
  command
      ->add_option("--systematic", options->systematic, "Largest relative depth error over the image, not the level's")
      ->check(CLI::Range(0.0, 0.1))
      ->type_name("X");
  command->add_option("--scale-error", options->scale_error, "Sd of a relative depth error that a whole scene has")
      ->check(CLI::Range(0.0, 0.1))
      ->type_name("X");
  command->add_flag("--frames", options->frames, "Also the camera's pictures of the patterns, with rig.json, for scan");
  command->add_option("--unit", options->unit, "Unit of CAD files that name none: mm, cm, m, inch")->type_name("U");
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
