#include <cstdio>
#include <fstream>

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
    if (p.type == PrimitiveType::torus) std::printf(" %9.3f  tube %.3f", p.radius_mm, p.minor_radius_mm);
    std::printf("\n");
  }
}

/// Primitive ids: of a grid as a picture, or as text, one id a line in the input's order.
void write_labels(const std::string& file, const Primitives& primitives, const Surfels& surfels) {
  const bool text = std::filesystem::path(file).extension() == ".txt";
  if (!text && surfels.scan == nullptr)
    throw Error(ErrorCode::bad_option, "--labels " + file + ": loose points have no picture; wanted a name in .txt");
  StagedOutput staged(file);
  if (text) {
    std::ofstream out(staged.path());
    for (std::uint16_t id :
         surfels.scan != nullptr ? label_pixels(primitives, surfels).data : label_points(primitives, surfels))
      out << id << '\n';
    out.close();
    if (!out) throw Error(ErrorCode::bad_option, file + ": cannot be written (is the disk full?)");
  } else {
    write_label_png(staged.path(), label_pixels(primitives, surfels));
  }
  staged.publish();
}

int run(const Options& options, const Context& context) {
  StageTimes times;
  ScanOrPoints input;
  {
    const StageTimer timer(times, "read");
    input = read_scan_or_points_logged(options.scan, options.camera, options.scan_unit);
  }
  Surfels surfels;
  {
    const StageTimer timer(times, "surface_normals");
    surfels = surfels_of(input, options.surfel);
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
    write_text(options.json, segment_json(surfels, primitives, model, times, {}, {.times = with_times}));
  if (!options.labels.empty()) write_labels(options.labels, primitives, surfels);
  if (!options.report.empty()) {
    StagedOutput staged(options.report);
    write_segment_report(staged.path(), surfels, primitives, model, times, {},
                         {context.command, {options.scan}, context.threads, with_times});
    staged.publish();
  }
  if (options.json != "-") print_table(primitives);
  return 0;
}

}  // namespace

void add_segment(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, context, "segment", "Find the planes, cylinders, cones and spheres of a scan or of loose points",
                  "tribin segment bin.pcd --radii 65,28 --json primitives.json --labels labels.png");
  add_any_scan(command, options->scan, options->camera, options->scan_unit);
  command->add_option("--radii", options->radii_mm, "Radii to expect [mm], with commas")
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->type_name("R,R,...");
  command->add_option("--json", options->json, "Write the result as JSON; - is stdout")->type_name("OUT|-");
  command
      ->add_option("--labels", options->labels,
                   "Write the primitive id of each pixel or point, 0 = none: 16-bit PNG, or text, one a line")
      ->type_name("FILE.png|.txt");
  command->add_option("--report", options->report, "Write a page with pictures and tables")->type_name("DIR");
  command->add_flag("--no-times", options->no_times, "Leave the times out: same input, same bytes");
  only_experts(command->add_option("--cell-px", options->surfel.cell_px), context);
  only_experts(command->add_option("--max-radius-mm", options->surfel.max_radius_mm), context);
  only_experts(command->add_option("--min-area-mm2", options->min_area_mm2), context);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
