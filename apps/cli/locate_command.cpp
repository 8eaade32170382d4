#include <algorithm>
#include <cctype>
#include <cstdio>
#include <iostream>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/report/figures.hpp"
#include "tribin/report/json.hpp"
#include "tribin/report/report.hpp"
#include "tribin/report/summary.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string scan, camera, bin, json, report, figures, truth, unit = "mm", scan_unit = "auto", method = "surfel";
  std::vector<std::string> parts, free_spin;
  double tolerance_mm = 0, tolerance_deg = 0;
  int time_limit_ms = 0;
  bool no_times = false, no_cache = false;
  FinderOptions finder;
};

/// The image's number in its data set: the file name's digits, as BOP has it.
int image_of(const std::filesystem::path& scan) {
  const std::string stem = scan.stem().string();
  const bool digits =
      !stem.empty() && std::all_of(stem.begin(), stem.end(), [](unsigned char c) { return std::isdigit(c); });
  return digits && stem.size() < 10 ? std::stoi(stem) : 0;
}

ReportTruth read_truth(const Options& options) {
  // DATASET/SPLIT/SCENE/scene_gt.json with DATASET/models
  const std::filesystem::path truth = std::filesystem::absolute(options.truth);
  const std::filesystem::path models = truth.parent_path().parent_path().parent_path() / "models";
  return {eval::read_bop_truth(truth, image_of(options.scan), models), eval::read_bop_models(models)};
}

/// The result for people: one line a part. Poses are in the input's frame, as in the JSON.
void print_table(const Scan& scan, std::span<const Part> parts, const Found& found,
                 const std::optional<ReportTruth>& truth) {
  std::printf("%s.\n", verdict(found, parts).c_str());
  if (!found.instances.items.empty() || !found.instances.uncertain.empty())
    std::printf("%-20s %5s %7s %10s %10s %10s %9s %9s %9s %8s %8s%s\n", "part", "score", "visible", "x mm", "y mm",
                "z mm", "Rx deg", "Ry deg", "Rz deg", "sd mm", "sd deg", truth ? " error mm  error deg" : "");
  std::optional<eval::Judgement> judged;
  if (truth) judged = eval::judge(found.instances.items, truth->truths, truth->models);
  std::vector<Instance> rows = found.instances.items;
  rows.insert(rows.end(), found.instances.uncertain.begin(), found.instances.uncertain.end());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Instance& instance = rows[i];
    const Pose pose = scan.input_from_camera * instance.camera_from_part;
    const Vec3 t = pose.translation(), r = yaskawa_angles(Matrix3(pose.linear())) / kDegree;
    const auto part = std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == instance.part; });
    const PoseSigma sigma = pose_sigma(instance, part == parts.end() ? Vec3(Vec3::Zero()) : part->box_center());
    std::printf("%-20s %5.3f %5.0f %% %10.3f %10.3f %10.3f %9.3f %9.3f %9.3f %8.4f %8.4f", instance.part.c_str(),
                instance.score, 100 * instance.visible_fraction, t.x(), t.y(), t.z(), r.x(), r.y(), r.z(),
                sigma.translation_mm, sigma.rotation / kDegree);
    if (i >= found.instances.items.size()) {
      std::printf("    not given out");
    } else if (judged) {
      const auto match = std::find_if(judged->found.begin(), judged->found.end(),
                                      [&](const eval::Match& m) { return m.answer == static_cast<int>(i); });
      if (match != judged->found.end())
        std::printf(" %8.4f  %8.4f", match->error.translation_mm, match->error.rotation / kDegree);
      else
        std::printf("    false answer");
    }
    std::printf("\n");
    for (const Alternative& other : instance.alternatives)
      std::printf("  or, with probability %.2f, another pose of it; decided by %s\n", other.probability,
                  other.decided_by.c_str());
    if (instance.quality.decision == QualityDecision::deviates)
      for (const std::string& reason : instance.quality.reasons) std::printf("  deviates: %s\n", reason.c_str());
  }
  if (judged && judged->found.size() < truth->truths.size())
    std::printf("%zu of %zu parts that are really there were not found.\n", judged->missed.size(),
                truth->truths.size());
}

void print_bin(const Scan& scan, const Found& found) {
  if (found.bin && found.bin->found) {
    const Vec3 t = scan.input_from_camera * Vec3(found.bin->camera_from_bin.translation());
    std::printf("Bin at %.2f, %.2f, %.2f mm, %.0f %% full", t.x(), t.y(), t.z(), 100 * found.bin->fill);
    if (found.bin->drift_sigma)
      std::printf(", %.2f mm from its place (%.1f sigmas)", found.bin->drift_mm, *found.bin->drift_sigma);
    std::printf(".\n");
  }
  for (const UnexplainedRegion& region : found.instances.unexplained) {
    const Vec3 c = scan.input_from_camera * region.center_mm;
    std::printf("Unexplained: %.0f mm3 at %.1f, %.1f, %.1f mm (%d pixels).\n", region.volume_mm3, c.x(), c.y(), c.z(),
                region.pixels);
  }
}

void print_times(const StageTimes& times) {
  for (const auto& [stage, ms] : times.stages_ms) std::printf("%s %.1f ms, ", stage.c_str(), ms);
  std::printf("total without read %.1f ms\n", times.total());
}

int exit_code(const Found& found) {
  if (!found.instances.items.empty()) return 0;
  if (found.status == "time_limit") return static_cast<int>(ErrorCode::time_limit);
  if (found.status == "no_data") return static_cast<int>(ErrorCode::too_little_data);
  return 1;
}

int run(Options options, const Context& context) {
  options.finder.method = options.method == "paper" ? Method::paper : Method::surfel;
  const std::vector<PartArgument> arguments = part_arguments(options.parts);
  StageTimes reading;
  Scan scan;
  {
    const StageTimer timer(reading, "read");
    scan = read_scan_logged(options.scan, options.camera, options.scan_unit);
  }
  std::vector<Part> parts = read_parts(arguments, options.unit, options.no_cache);
  declare_free_spins(options.free_spin, parts);
  std::optional<ReportTruth> truth;
  if (!options.truth.empty()) truth = read_truth(options);

  options.finder.tolerance_mm = options.tolerance_mm;
  options.finder.tolerance_rad = options.tolerance_deg * kDegree;
  options.finder.time_limit_ms = options.time_limit_ms;
  if (!options.bin.empty()) options.finder.bin = known_bin(read_bin(options.bin), scan);
  Found found = find_parts(scan, parts, options.finder);
  found.times.stages_ms.insert(found.times.stages_ms.begin(), reading.stages_ms.begin(), reading.stages_ms.end());
  for (const Warning& warning : found.warnings) log(LogLevel::warning, warning.text);

  const std::string json = locate_json(scan, found, {.times = !options.no_times});
  if (!options.json.empty()) write_text(options.json, json);
  if (!options.report.empty()) {
    ReportContext report{context.command, {options.scan}, context.threads, !options.no_times};
    for (const PartArgument& argument : arguments) report.files.push_back(argument.file);
    StagedOutput staged(options.report);
    write_locate_report(staged.path(), scan, parts, found, report, truth);
    staged.publish();
  }
  if (!options.figures.empty()) {
    StagedOutput staged(options.figures);
    write_paper_figures(staged.path(), scan, parts, found);
    staged.publish();
  }
  if (options.json != "-") {
    print_table(scan, parts, found, truth);
    print_bin(scan, found);
    if (!options.no_times) print_times(found.times);
  }
  return exit_code(found);
}

}  // namespace

void add_locate(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, context, "locate", "Find CAD parts in a scan: class and 6-DOF pose of each",
                  "tribin locate bin.pcd --part pulley.step --part shaft=8812-b.stl --json - --report out");
  command->add_option("SCAN", options->scan, "Scan: PCD, PLY, depth PNG or TIFF with camera.json, NPY")->required();
  command->add_option("--part", options->parts, "CAD of a part to look for; repeat it for more")
      ->required()
      ->type_name("[NAME=]CAD")
      ->allow_extra_args(false);
  add_free_spin(command, options->free_spin);
  command->add_option("--camera", options->camera, "Camera file of a depth image (camera.json, BOP scene_camera.json)")
      ->type_name("FILE");
  command
      ->add_option("--bin", options->bin,
                   "The bin that the parts lie in: a file with [bin], or a work cell. Without its place it is sought")
      ->type_name("BIN.toml");
  command->add_option("--tolerance-mm", options->tolerance_mm, "Give the probability that the place is within this")
      ->check(CLI::NonNegativeNumber)
      ->type_name("X");
  command->add_option("--tolerance-deg", options->tolerance_deg, "... and the rotation within this")
      ->check(CLI::NonNegativeNumber)
      ->type_name("X");
  command->add_option("--time-limit-ms", options->time_limit_ms, "Stop after this long with what is settled")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command->add_option("--unit", options->unit, "Unit of CAD files that name none: mm, cm, m, inch")->type_name("U");
  command
      ->add_option("--scan-unit,--depth-unit", options->scan_unit,
                   "Unit of clouds and of depth images of floats: mm, m, auto")
      ->type_name("U");
  command
      ->add_option("--method", options->method,
                   "surfel, or paper: recognition and pose as Barajas et al. have them (docs/paper_method.md)")
      ->check(CLI::IsMember({"surfel", "paper"}))
      ->type_name("M");
  command->add_option("--json", options->json, "Write the result as JSON; - is stdout")->type_name("OUT|-");
  command->add_option("--report", options->report, "Write a page with pictures, evidence and reasons")
      ->type_name("DIR");
  command->add_option("--truth", options->truth, "scene_gt.json of a simulated scan: adds the errors")
      ->type_name("FILE");
  command->add_flag("--no-times", options->no_times, "Leave the times out: same input, same bytes");
  add_no_cache(command, options->no_cache);
  only_experts(command->add_option("--figures", options->figures), context);
  only_experts(command->add_option("--cell-px", options->finder.surfel.cell_px), context);
  only_experts(command->add_option("--work-limit", options->finder.work_limit), context);
  only_experts(command->add_option("--max-radius-mm", options->finder.surfel.max_radius_mm), context);
  only_experts(command->add_option("--min-area-mm2", options->finder.segmentation.min_area_mm2), context);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
