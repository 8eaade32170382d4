#include <cstdio>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/report/json.hpp"
#include "tribin/report/label_png.hpp"
#include "tribin/report/report.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string scan, camera, json, labels, report, scan_unit = "auto";
  std::vector<double> radii_mm;
  bool no_times = false;
  SurfelOptions surfel;
  double min_area_mm2 = 0;
};

void print_table(const Primitives& primitives) {
  std::printf("%4s %-9s %10s %9s %9s %9s %9s\n", "id", "type", "points", "rms mm", "radius mm", "height mm", "arc deg");
  for (const Primitive& p : primitives.items) {
    std::printf("%4d %-9s %10d %9.4f", p.id, name_of(p.type), p.points, p.rms_mm);
    if (p.type == PrimitiveType::cylinder)
      std::printf(" %9.3f %9.2f %9.1f%s", p.radius_mm, p.height_mm(), p.arc / kDegree, p.concave ? "  concave" : "");
    if (p.type == PrimitiveType::sphere) std::printf(" %9.3f", p.radius_mm);
    std::printf("\n");
  }
}

int run(const Options& options, const Context& context) {
  StageTimes times;
  Scan scan;
  {
    const StageTimer timer(times, "read");
    scan = read_scan_logged(options.scan, options.camera, options.scan_unit);
  }
  Surfels surfels;
  {
    const StageTimer timer(times, "surface_normals");
    surfels = surfels_from_scan(scan, options.surfel);
  }
  Primitives primitives;
  {
    const StageTimer timer(times, "segmentation");
    primitives = segment(surfels, {.radii_mm = options.radii_mm, .min_area_mm2 = options.min_area_mm2});
  }
  PrimitiveModel model;
  {
    const StageTimer timer(times, "modelling");
    model = build_model(primitives, surfels);
  }
  const bool with_times = !options.no_times;
  if (!options.json.empty())
    write_text(options.json, segment_json(scan, surfels, primitives, model, times, {}, {.times = with_times}));
  if (!options.labels.empty()) {
    StagedOutput staged(options.labels);
    write_label_png(staged.path(), label_pixels(primitives, surfels));
    staged.publish();
  }
  if (!options.report.empty()) {
    StagedOutput staged(options.report);
    write_segment_report(staged.path(), scan, surfels, primitives, model, times, {},
                         {context.command, {options.scan}, context.threads, with_times});
    staged.publish();
  }
  if (options.json != "-") print_table(primitives);
  return 0;
}

}  // namespace

void add_segment(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "segment", "Find the planes, cylinders, cones and spheres of a scan",
                                  "tribin segment bin.pcd --radii 65,28 --json primitives.json --labels labels.png");
  command->add_option("SCAN", options->scan, "Scan: PCD, PLY, depth PNG or TIFF with camera.json, NPY")->required();
  command->add_option("--camera", options->camera, "Camera file of a depth image")->type_name("FILE");
  command->add_option("--radii", options->radii_mm, "Radii to expect [mm], with commas")
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->type_name("R,R,...");
  command->add_option("--scan-unit", options->scan_unit, "Unit of clouds: mm, m, auto")->type_name("U");
  command->add_option("--json", options->json, "Write the result as JSON; - is stdout")->type_name("OUT|-");
  command->add_option("--labels", options->labels, "Write the primitive id of each pixel as 16-bit PNG, 0 = none")
      ->type_name("FILE.png");
  command->add_option("--report", options->report, "Write a page with pictures and tables")->type_name("DIR");
  command->add_flag("--no-times", options->no_times, "Leave the times out: same input, same bytes");
  only_experts(command->add_option("--cell-px", options->surfel.cell_px), context);
  only_experts(command->add_option("--max-radius-mm", options->surfel.max_radius_mm), context);
  only_experts(command->add_option("--min-area-mm2", options->min_area_mm2), context);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
