#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cell_view.hpp"
#include "commands.hpp"
#include "output.hpp"
#include "tribin/config/robot_file.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/grasp/grasp.hpp"
#include "tribin/picking/vision.hpp"
#include "tribin/report/grasp_json.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string scan, cell, json, scan_unit = "auto";
  double max_tilt_deg = -1, waist_deg = 0;
  bool no_arm = false, pushes = false, no_cache = false;
};

void print_table(const grasp::Plan& plan) {
  std::printf("%-4s %-16s %-10s %-24s %6s %8s %8s %9s  %s\n", "rank", "part", "gripper", "family", "score", "tilt deg",
              "open mm", "clear mm", "held back by");
  int rank = 0;
  for (const grasp::Grasp& g : plan.grasps) {
    const Matrix3 pick = g.at(grasp::Step::pick)->base_from_tcp.linear();
    const auto least = std::min_element(g.terms.begin(), g.terms.end(),
                                        [](const grasp::Term& a, const grasp::Term& b) { return a.value < b.value; });
    std::printf("%-4d %-16s %-10s %-24s %6.3f %8.1f %8.1f %9.1f  %s %.2f\n", ++rank, g.part_name.c_str(),
                g.gripper.c_str(), g.family.c_str(), g.score, std::acos(std::clamp(-pick(2, 2), -1.0, 1.0)) / kDegree,
                g.opening_before_mm, g.clearance_mm, least->name.c_str(), least->value);
  }
  std::printf("%zu grasps; refused:", plan.grasps.size());
  for (const grasp::WhyCount& r : plan.reasons) std::printf(" %s %d", std::string(name_of(r.why)).c_str(), r.count);
  std::printf("%s\n", plan.reasons.empty() ? " none" : "");
}

int run(const Options& options, const Context&) {
  const WorkCell cell = read_work_cell_logged(options.cell);
  if (cell.parts.empty()) throw Error(ErrorCode::bad_input, options.cell + ": saw no [[part]], wanted at least one");
  if (cell.grippers.empty())
    throw Error(ErrorCode::bad_input, options.cell + ": saw no [[gripper]], wanted at least one");
  const Scan scan = read_scan_logged(options.scan, cell.camera->file.string(), options.scan_unit);
  const std::vector<Part> parts = read_parts_of(cell, options.no_cache);
  std::vector<grasp::GraspPart> known;
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    known.push_back(grasp::prepare_grasps(parts[i], cell.parts[i], cell.grippers));
    warnings.insert(warnings.end(), known.back().warnings.begin(), known.back().warnings.end());
  }
  FinderOptions finder;
  if (cell.bin) finder.bin = known_bin(cell, scan);
  const Found found = find_parts(scan, parts, finder);
  const Pose base_from_scan = base_from_camera(cell, scan.taken, options.scan) * scan.input_from_camera;
  grasp::Scene scene = grasp::scene_of(cell, scan, base_from_scan, found.instances, known);
  robot::RobotModel robot;
  if (!options.no_arm && !cell.robots.empty()) {
    robot = read_robot(cell.robots.front().model);
    scene.arm = grasp::ArmHere{&robot, &picking::arm_of(cell, robot), options.waist_deg * kDegree, {}};
  }
  grasp::PlanOptions plan_options;
  if (options.max_tilt_deg >= 0) plan_options.max_tilt_rad = options.max_tilt_deg * kDegree;
  const grasp::Plan plan = grasp::plan_grasps(scene, plan_options);
  std::optional<grasp::PushPlan> pushes;
  if (options.pushes) pushes = grasp::plan_pushes(scene, plan_options);
  for (const std::string& warning : warnings) log(LogLevel::warning, warning);
  for (const std::string& warning : plan.warnings) log(LogLevel::warning, warning);
  if (!options.json.empty()) write_text(options.json, grasps_json(scene, plan, pushes ? &*pushes : nullptr, warnings));
  if (options.json != "-") {
    print_table(plan);
    if (pushes) std::printf("%zu pushes\n", pushes->pushes.size());
  }
  return plan.grasps.empty() ? 1 : 0;
}

}  // namespace

void add_grasps(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, context, "grasps", "Plan how the parts in a scan may be gripped, and say why not",
                  "tribin grasps bin.pcd --workcell cell.toml --json -");
  command->add_option("SCAN", options->scan, "Scan: PCD, PLY, depth PNG or TIFF, NPY")->required();
  command->add_option("--workcell", options->cell, "Camera, bin, grippers, parts, robot")
      ->required()
      ->type_name("TOML");
  command->add_option("--max-tilt-deg", options->max_tilt_deg, "Of the approach, where the parts allow more")
      ->check(CLI::Range(0.0, 180.0))
      ->type_name("X");
  command->add_flag("--no-arm", options->no_arm, "Leave the cell's robot out: neither reach nor links are checked");
  command->add_option("--waist-deg", options->waist_deg, "Where the waist of a dual-arm robot stands")->type_name("X");
  command->add_flag("--pushes", options->pushes, "Plan pushes too");
  command
      ->add_option("--scan-unit,--depth-unit", options->scan_unit,
                   "Unit of clouds and of depth images of floats: mm, m, auto")
      ->type_name("U");
  command->add_option("--json", options->json, "Write the plan as JSON; - is stdout")->type_name("OUT|-");
  add_no_cache(command, options->no_cache);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
