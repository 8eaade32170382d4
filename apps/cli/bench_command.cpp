#include <algorithm>
#include <cmath>
#include <iostream>

#include "bench_heaps.hpp"
#include "bench_peers.hpp"
#include "commands.hpp"
#include "output.hpp"
#include "paper_tables.hpp"
#include "progress.hpp"
#include "tribin/core/error.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/paper_method/recognize.hpp"
#ifdef TRIBIN_WITH_SIM
#include "tribin/sim/paper_experiment.hpp"
#endif

namespace tribin::cli {
namespace {

struct Options {
  std::vector<std::string> parts = {"examples/parts/alternator_a.step", "examples/parts/alternator_b.step"};
  std::string heaps;
  int scenes = 10;
  std::string json, unit = "mm", method = "both";
  int poses = 40;
  int first = 1;
  double noise_mm = 0.1, noise_correlation_px = 1;
  bool no_times = false, peers = false;
};

#ifdef TRIBIN_WITH_SIM
/// The bound's sd of the box's centre [mm] and of the rotation [rad], as norms.
void set_bound(PaperRun& run, const sim::PaperScene& scene, const Part& part, double correlation_px) {
  const Matrix6 bound = sim::cramer_rao_bound(scene.simulated, 1, correlation_px);
  const sim::PoseBound norms = sim::pose_bound(bound, scene.camera_from_part, part.box_center());
  run.bound_translation_mm = norms.translation_mm;
  run.bound_rotation = norms.rotation;
}

/// The test that stopped those candidates of a part which came furthest.
std::string furthest_test(const std::vector<Reason>& rejected, const std::string& part) {
  static const std::vector<std::string> kStages = {"matching", "key_cylinders", "key_planes", "pose"};
  std::ptrdiff_t furthest = -1;
  int most = 0;
  std::string test;
  for (const Reason& reason : rejected) {
    if (reason.part != part) continue;
    const std::ptrdiff_t stage = std::find(kStages.begin(), kStages.end(), reason.stage) - kStages.begin();
    if (stage < furthest || (stage == furthest && reason.count <= most)) continue;
    furthest = stage, most = reason.count, test = reason.test;
  }
  return test;
}

/// The paper's recognition and pose on the primitives that ours worked on.
PaperMethodRun run_paper_method(const Found& found, const std::vector<Part>& parts,
                                const std::vector<eval::Model>& models, const eval::Truth& truth) {
  PaperMethodRun run;
  StageTimes times;
  Instances answers;
  {
    const StageTimer timer(times, "recognition_and_pose");
    answers = paper::recognize(found.primitives, found.observation, found.surfels, parts);
  }
  run.ms = times.total();
  if (answers.items.empty()) {
    run.refused_by = furthest_test(answers.rejected, truth.part);
    return run;
  }
  const Instance& best = answers.items.front();
  run.answered = true;
  run.class_right = best.part == truth.part;
  run.found = !eval::judge(std::span(&best, 1), std::span(&truth, 1), models).found.empty();
  for (const eval::Model& model : models)
    if (run.class_right && model.name == truth.part)
      run.error = eval::pose_error(model, best.camera_from_part, truth.camera_from_part);
  return run;
}

PaperRun run_one(const std::vector<Part>& parts, const std::vector<eval::Model>& models, std::size_t which,
                 const std::vector<sim::StableRest>& rests, int seed, const Options& options) {
  const sim::PaperScene scene =
      sim::paper_scene(parts[which].mesh, rests, seed,
                       {.noise_mm = options.noise_mm, .noise_correlation_px = options.noise_correlation_px});
  const Found found = find_parts(scene.scan(), parts);  // both parts are offered each time
  PaperRun run;
  run.part = parts[which].name;
  run.seed = seed;
  run.times = found.times;
  const std::vector<eval::Truth> truths = {{run.part, scene.camera_from_part, 1.0}};
  const eval::Judgement judged = eval::judge(found.instances.items, truths, models);
  run.class_right = !found.instances.items.empty() && found.instances.items.front().part == run.part;
  run.found = !judged.found.empty();
  run.false_answers = static_cast<int>(judged.false_answers.size());
  if (run.found) run.error = judged.found.front().error;
  if (options.method == "both") run.paper = run_paper_method(found, parts, models, truths.front());
  try {
    set_bound(run, scene, parts[which], options.noise_correlation_px);
  } catch (const Error&) {
    // A direction that no pixel holds: this pose has no bound, and is left out of the ratio.
  }
  return run;
}

int run_experiment(const Options& options, const Context& context) {
  const std::vector<Part> parts = read_parts(part_arguments(options.parts), options.unit);
  if (options.peers) {
    constexpr int kScenes = 3;  // of each part: a peer takes seconds for one
    std::cout << compare_with_peers(parts, options.first, std::min(kScenes, options.poses));
    std::cout << compare_decoding(parts[0], options.first);
    return 0;
  }
  std::vector<eval::Model> models;
  for (const Part& part : parts) models.push_back(eval::model_of(part));
  std::vector<PaperRun> runs;
  {
    Progress progress("The paper's experiment", static_cast<int>(parts.size()) * options.poses, context.quiet);
    for (std::size_t which = 0; which < parts.size(); ++which) {
      const std::vector<sim::StableRest> rests = sim::stable_rests(parts[which].mesh);
      for (int seed = options.first; seed < options.first + options.poses; ++seed) {
        runs.push_back(run_one(parts, models, which, rests, seed, options));
        progress.done(static_cast<int>(runs.size()));
        if (context.verbose)
          std::cerr << runs.back().part << " seed " << seed << (runs.back().found ? ": " : ": not found ")
                    << runs.back().error.translation_mm << " mm, " << runs.back().error.rotation / kDegree << " deg"
                    << paper_method_words(runs.back()) << "\n";
      }
    }
  }
  if (!options.json.empty()) write_text(options.json, paper_json(runs, !options.no_times));
  if (options.json != "-") std::cout << paper_tables(runs);
  return 0;
}
#else
int run_experiment(const Options&, const Context&) { refuse_without_simulation(); }
#endif

int run(const Options& options, const Context& context) {
  if (options.heaps.empty()) return run_experiment(options, context);
  std::cout << compare_heaps(options.heaps, options.scenes);
  return 0;
}

}  // namespace

void add_bench(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "bench", "The paper's experiment: its tables, ours beside them",
                                  "tribin bench --poses 40");
  command->add_option("--part", options->parts, "The two parts; default: the alternators of examples/parts")
      ->type_name("[NAME=]CAD")
      ->allow_extra_args(false);
  command->add_option("--poses", options->poses, "Poses of each part")->check(CLI::Range(1, 100000))->type_name("N");
  command->add_option("--first", options->first, "First seed; the poses take consecutive ones")
      ->check(CLI::Range(1, 1000000000))
      ->type_name("S");
  command->add_option("--noise-mm", options->noise_mm, "Noise of a facing surface at 800 mm")
      ->check(CLI::PositiveNumber)
      ->type_name("X");
  command->add_option("--noise-correlation-px", options->noise_correlation_px, "Its correlation")
      ->check(CLI::Range(0.0, 5.0))
      ->type_name("X");
  command
      ->add_option("--method", options->method,
                   "both: the paper's recognition and pose too, on the same primitives; surfel: ours alone")
      ->check(CLI::IsMember({"both", "surfel"}))
      ->type_name("M");
  command->add_option("--unit", options->unit, "Unit of CAD files that name none: mm, cm, m, inch")->type_name("U");
  command->add_option("--json", options->json, "Write every run as JSON; - is stdout")->type_name("OUT|-");
  command->add_flag("--peers", options->peers, "Instead: normals, segmentation and decoding beside other libraries");
  command->add_option("--heaps", options->heaps, "Instead: a data set of tribin simulate, beside other libraries")
      ->check(CLI::ExistingDirectory)
      ->type_name("DATASET");
  command->add_option("--scenes", options->scenes, "Of --heaps: the first ones")
      ->check(CLI::Range(1, 100000))
      ->type_name("N");
  command->add_flag("--no-times", options->no_times, "Leave the times out: same input, same bytes");
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
