#include <cstdio>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/log.hpp"
#include "tribin/core/stage_times.hpp"
#include "tribin/io/part_cache.hpp"
#include "tribin/report/json.hpp"
#include "tribin/report/report.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string cad, unit = "mm", json, report;
  bool no_times = false, no_cache = false;
};

void print_table(const Part& part) {
  const Vec3 size = part.box_max - part.box_min;
  std::printf("%s: %.1f x %.1f x %.1f mm, diameter %.2f mm, %zu triangles\n", part.name.c_str(), size.x(), size.y(),
              size.z(), part.diameter_mm, part.mesh.triangles.size());
  const std::size_t turns = part.symmetry.discrete.empty() ? 0 : part.symmetry.discrete.size() - 1;
  std::printf("symmetry: %s, %zu further pose%s that leave%s it as it is, %zu self-similar\n",
              part.symmetry.continuous.empty() ? "no axis of free turning" : "free turning about one axis", turns,
              turns == 1 ? "" : "s", turns == 1 ? "s" : "", part.self_similar.size());
  std::printf("%4s %-9s %10s %9s %9s %s\n", "id", "type", "area mm2", "radius mm", "height mm", "");
  for (const Primitive& p : part.model.primitives) {
    std::printf("%4d %-9s %10.1f", p.id, name_of(p.type), p.area_mm2);
    if (p.type == PrimitiveType::cylinder)
      std::printf(" %9.3f %9.2f %s", p.radius_mm, p.height_mm(), p.concave ? "hole" : "");
    if (p.type == PrimitiveType::sphere) std::printf(" %9.3f", p.radius_mm);
    std::printf("\n");
  }
}

int run(const Options& options, const Context& context) {
  StageTimes times;
  PartReadOptions reading;
  reading.cad.unit = length_unit_from_name(options.unit);
  if (!options.no_cache) reading.cache = part_cache_folder();
  const Part part = read_part(options.cad, reading, &times);
  for (const std::string& warning : part.warnings)
    log(LogLevel::warning, std::filesystem::path(options.cad).filename().string() + ": " + warning);
  const std::string file = std::filesystem::path(options.cad).filename().string();
  if (!options.json.empty()) write_text(options.json, part_json(part, file, times, {.times = !options.no_times}));
  if (!options.report.empty()) {
    StagedOutput staged(options.report);
    write_part_report(staged.path(), part, file, times,
                      {context.command, {options.cad}, context.threads, !options.no_times});
    staged.publish();
  }
  if (options.json != "-") print_table(part);
  return 0;
}

}  // namespace

void add_part(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, context, "part", "What a CAD file gives: primitives, symmetry, how findable it is",
                  "tribin part pulley.stl --unit mm --json - --report out");
  command->add_option("CAD", options->cad, "CAD: STEP, IGES, DXF, STL, OBJ, PLY")->required();
  command->add_option("--unit", options->unit, "Unit of files that name none: mm, cm, m, inch")->type_name("U");
  command->add_option("--json", options->json, "Write the result as JSON; - is stdout")->type_name("OUT|-");
  command->add_option("--report", options->report, "Write a page with pictures and tables")->type_name("DIR");
  command->add_flag("--no-times", options->no_times, "Leave the times out: same input, same bytes");
  add_no_cache(command, options->no_cache);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
