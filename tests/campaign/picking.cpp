// Simulated cells from full bin to full rack: what is placed, how, and what is left.
// usage: campaign_picking [BINS] [SEED] [--workcell FILE] [--parts N] [--at-walls] [--one-arm] [-v]
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>

#include "tribin/config/robot_file.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/part_cache.hpp"
#include "tribin/picking/cycle.hpp"
#include "tribin/robot/cell_limits.hpp"
#include "tribin/sim/work_cell.hpp"

namespace {

using namespace tribin;

struct Totals {
  int bins = 0, parts = 0, placed = 0, placed_without_help = 0, picks = 0, missed = 0, lost = 0, put_down = 0,
      pushes = 0;
  int collisions = 0, wrong = 0, twice = 0, disturbed = 0;
  int measured = 0;                    ///< looks at a part in the hand that were believed
  std::map<std::string, int> in_hand;  ///< why they were not, or why the grip was not
  std::map<std::string, int> ends, refused, left, grip_failures, touched;
  double robot_s = 0;
  std::vector<double> off_mm, off_deg, find_ms, plan_ms, cycle_s;
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

void judge(const WorkCell& cell, const sim::CellTruth& truth, const picking::Filling& filling, Totals& totals) {
  const std::vector<picking::Slot> slots = picking::slots_of(*cell.rack);
  std::vector<int> stands(slots.size());
  for (const sim::PartTruth& part : truth.parts) {
    ++totals.parts;
    totals.twice += part.times_placed > 1;
    if (part.where == sim::Whereabouts::placed) {
      ++totals.placed;
      const auto slot = static_cast<std::size_t>(part.slot) - 1;
      totals.wrong += !may_stand(slots[slot], part.part) || filling[slot] != part.part || ++stands[slot] > 1;
      totals.off_mm.push_back(part.off_mm);
      totals.off_deg.push_back(part.off_rad / kDegree);
    } else {
      constexpr const char* kWhere[] = {"in the bin", "in the hand", "placed", "at the station", "lost"};
      ++totals.left[part.part + " " + kWhere[static_cast<int>(part.where)]];
    }
  }
  for (std::size_t i = 0; i < slots.size(); ++i) totals.wrong += !filling[i].empty() && stands[i] == 0;
  totals.collisions += static_cast<int>(truth.collisions.size());
  totals.disturbed += truth.disturbed;
  for (const std::string& why : truth.failed_grips) ++totals.grip_failures[why];
}

/// How far off vision saw the part that a grip missed, and why it does not hold: "0.4 mm 0.2 deg off: ...".
std::string about_miss(const sim::CellTruth& truth, const picking::CycleReport& report, const Part& model) {
  double mm = 1e9, deg = 0;
  for (const sim::PartTruth& part : truth.parts) {
    const double off = (part.base_from_part * model.box_center() - report.base_from_part * model.box_center()).norm();
    if (part.part != report.part || off > mm) continue;
    mm = off, deg = 1e9;
    for (const Pose& same : picking::alike(model, report.base_from_part))
      deg = std::min(deg, rotation_angle(same.linear(), part.base_from_part.linear()) / kDegree);
  }
  char text[80];
  std::snprintf(text, sizeof text, "seen %.2f mm %.2f deg off: ", mm, deg);
  return text + (truth.failed_grips.empty() ? std::string() : truth.failed_grips.back());
}

/// Where a part that is left lies: its box in the bin's frame, the room to the walls, the part's axes that look up.
std::string about_left(const WorkCell& cell, const sim::PartTruth& part, const Part& model) {
  const Pose bin_from_part = cell.bin->base_from_bin.inverse() * part.base_from_part;
  Vec3 low = Vec3::Constant(1e9), high = Vec3::Constant(-1e9);
  for (const Vec3f& v : model.mesh.vertices) {
    const Vec3 p = bin_from_part * v.cast<double>();
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  const Vec3 half = cell.bin->inner_size_mm / 2;
  char text[200];
  std::snprintf(text, sizeof text,
                "%s: %.0f x %.0f x %.0f mm, room to the walls %.0f %.0f %.0f %.0f mm, up (%.2f %.2f %.2f)",
                part.part.c_str(), high.x() - low.x(), high.y() - low.y(), high.z() - low.z(), half.x() + low.x(),
                half.x() - high.x(), half.y() + low.y(), half.y() - high.y(), bin_from_part.linear()(2, 0),
                bin_from_part.linear()(2, 1), bin_from_part.linear()(2, 2));
  return text;
}

void print(const char* name, const std::map<std::string, int>& counts) {
  std::printf("%s:", name);
  for (const auto& [what, count] : counts) std::printf(" %s %d;", what.c_str(), count);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) try {
  int bins = 50, parts_in_bin = 15, numbers = 0;
  std::uint64_t seed = 1;
  bool verbose = false, at_walls = false, one_arm = false;
  std::string file = std::string(TRIBIN_SOURCE_DIR) + "/examples/cells/pick_cell.toml";
  for (int i = 1; i < argc; ++i)
    if (std::strcmp(argv[i], "--workcell") == 0 && i + 1 < argc)
      file = argv[++i];
    else if (std::strcmp(argv[i], "--parts") == 0 && i + 1 < argc)
      parts_in_bin = std::atoi(argv[++i]);
    else if (std::strcmp(argv[i], "--at-walls") == 0)
      at_walls = true;
    else if (std::strcmp(argv[i], "--one-arm") == 0)  // of two
      one_arm = true;
    else if (std::strcmp(argv[i], "-v") == 0)
      verbose = true;
    else if (numbers++ == 0)
      bins = std::atoi(argv[i]);
    else
      seed = std::strtoull(argv[i], nullptr, 10);
  WorkCell cell = read_work_cell(file);
  if (one_arm) cell.robots.resize(1);
  const robot::RobotModel robot = read_robot(cell.robots.at(0).model);
  std::vector<Part> parts;
  std::vector<Mesh> meshes;
  for (const CellPart& part : cell.parts) {
    PartReadOptions options;
    options.name = part.name;
    options.cad.unit = length_unit_from_name(part.unit);
    options.cache = part_cache_folder();
    parts.push_back(read_part(part.cad, options));
    meshes.push_back(parts.back().mesh);
  }
  const auto stock = sim::make_cell_stock(meshes);
  Totals totals;
  for (int bin = 0; bin < bins; ++bin) {
    sim::SimulatedCellOptions options;
    options.seed = seed + static_cast<std::uint64_t>(bin);
    options.parts = parts_in_bin;
    options.at_walls = at_walls || bin % 5 == 4;  // every fifth bin has parts on end at walls and in corners
    sim::SimulatedCell simulated(cell, robot, stock, options);
    const auto vision = picking::open_vision({&cell, &parts, &simulated.camera(), &robot});
    const std::filesystem::path journal_file =
        std::filesystem::temp_directory_path() / ("tribin_picking_" + std::to_string(::getpid()) + ".ndjson");
    std::filesystem::remove(journal_file);
    picking::Journal journal(journal_file, picking::slots_of(*cell.rack).size());
    robot::SafetyLimits limits = robot::limits_of(cell);
    for (std::size_t i = 0; i < cell.grippers.size(); ++i) limits.tools.insert(static_cast<int>(i) + 1);
    const auto controller = robot::make_guarded(simulated.connect(), limits, true);
    int without_help = 0;
    std::map<std::string, bool> helped;
    picking::RunOptions run;
    run.told = [&](const picking::CycleReport& report) {
      totals.missed += report.state == "missed";
      totals.lost += report.state == "lost";
      totals.put_down += report.state == "put_down";
      totals.pushes += report.state == "pushed";
      if (report.state == "placed") {
        without_help += report.resort == picking::Resort::none;
        totals.cycle_s.push_back(report.robot_s);
      }
      if (report.in_hand && (report.state == "placed" || report.state == "put_down")) {
        totals.measured += report.in_hand->measured;
        if (!report.in_hand->why.empty()) ++totals.in_hand[report.in_hand->why];
        if (verbose)
          std::printf("      in the hand: %s, sigma %.2f mm, moved %.2f mm %.2f deg %s\n",
                      report.in_hand->measured ? "measured" : "as gripped", report.in_hand->sigma_mm,
                      report.in_hand->moved_mm, report.in_hand->moved / kDegree, report.in_hand->why.c_str());
      }
      if (report.find_ms > 0) totals.find_ms.push_back(report.find_ms);
      totals.plan_ms.push_back(report.plan_ms);
      for (const auto& reason : report.refused) totals.refused[std::string(name_of(reason.why))] += reason.count;
      if (verbose)
        std::printf(
            "    %.1f s: scene %d cycle %d %s %s %s (%s) slot %d resort %s score %.3f find %.0f ms plan %.0f ms %.1f s "
            "%s\n",
            simulated.clock().now_s(), report.scene, report.cycle, report.state.c_str(), report.part.c_str(),
            report.grasp.c_str(), report.gripper.c_str(), report.slot, std::string(name_of(report.resort)).c_str(),
            report.score, report.find_ms, report.plan_ms, report.robot_s, report.note.c_str());
      if (verbose && report.state == "missed")
        std::printf("      %s\n", about_miss(simulated.truth(), report, vision->model(report.part)).c_str());
      std::fflush(stdout);
    };
    picking::RunEnd end;
    try {
      end = picking::run_picking({&cell, &robot, vision.get(), controller.get(), &simulated.clock(), &journal, limits},
                                 run);
    } catch (const Error& error) {
      end.status = "error";
      end.message = error.what();
    }
    const sim::CellTruth& truth = simulated.truth();
    ++totals.bins;
    ++totals.ends[end.status];
    totals.placed_without_help += without_help;
    totals.picks += truth.grips;
    totals.robot_s += truth.simulated_s;
    judge(cell, truth, journal.state().filling, totals);
    if (verbose && end.status == "not_pickable") {  // what is left, and why no gripper takes it
      picking::Places anywhere;
      for (const CellPart& part : cell.parts) anywhere[part.name];
      grasp::PlanOptions all;
      all.most_per_part = 12;
      const grasp::Plan plan = vision->plan(all, anywhere);
      std::map<std::string, std::map<std::string, int>> why;
      for (const auto& refused : plan.refused)
        ++why["part " + std::to_string(refused.part) + " " + refused.gripper][std::string(name_of(refused.why))];
      for (const auto& [who, counts] : why) print(("    left: " + who).c_str(), counts);
      std::printf("    left: %zu grasps that lead to no place\n", plan.grasps.size());
      std::map<std::string, int> pushes;
      for (const auto& reason : vision->plan_pushes(all).reasons)
        pushes[std::string(name_of(reason.why))] = reason.count;
      print("    left: pushes refused", pushes);
    }
    int placed = 0;
    for (const sim::PartTruth& part : truth.parts) placed += part.where == sim::Whereabouts::placed;
    std::printf("bin %d (seed %llu): %d of %zu placed, %d grips, %zu collisions, %.0f s; %s: %s\n", bin + 1,
                static_cast<unsigned long long>(options.seed), placed, truth.parts.size(), truth.grips,
                truth.collisions.size(), truth.simulated_s, end.status.c_str(), end.message.c_str());
    if (verbose)
      for (const sim::PartTruth& part : truth.parts)
        if (part.where == sim::Whereabouts::placed)
          std::printf("    %s in slot %d: %.2f mm, %.2f deg off\n", part.part.c_str(), part.slot, part.off_mm,
                      part.off_rad / kDegree);
    if (verbose)
      for (const sim::PartTruth& part : truth.parts)
        if (part.where == sim::Whereabouts::in_bin)
          std::printf("    left %s\n", about_left(cell, part, vision->model(part.part)).c_str());
    if (verbose)
      for (const sim::CellCollision& c : truth.collisions)
        std::printf("    collision at %.1f s, cycle %d: %s, %.2f mm\n", c.time_s, c.cycle, c.what.c_str(), c.depth_mm);
    std::fflush(stdout);
    std::filesystem::remove(journal_file);
  }
  // What is put down at the station is gripped there once more: a step of its way, no new attempt.
  std::printf(
      "%d bins, %d parts: placed %d (%.1f %%), without help %d (%.1f %%); %.2f attempts a placed part, %.2f grips with "
      "those at the station\n",
      totals.bins, totals.parts, totals.placed, 100.0 * totals.placed / std::max(1, totals.parts),
      totals.placed_without_help, 100.0 * totals.placed_without_help / std::max(1, totals.parts),
      static_cast<double>(totals.picks - totals.put_down) / std::max(1, totals.placed),
      static_cast<double>(totals.picks) / std::max(1, totals.placed));
  std::printf("missed %d, lost %d, gripped anew %d, pushes %d, disturbed %d\n", totals.missed, totals.lost,
              totals.put_down, totals.pushes, totals.disturbed);
  std::printf("collisions %d, wrong class or slot %d, placed twice %d\n", totals.collisions, totals.wrong,
              totals.twice);
  std::printf("placed off: median %.2f mm %.2f deg, 95 %% %.2f mm %.2f deg\n", quantile(totals.off_mm, 0.5),
              quantile(totals.off_deg, 0.5), quantile(totals.off_mm, 0.95), quantile(totals.off_deg, 0.95));
  std::printf("vision: find median %.0f ms, 95 %% %.0f ms; grasps median %.0f ms, 95 %% %.0f ms (this machine)\n",
              quantile(totals.find_ms, 0.5), quantile(totals.find_ms, 0.95), quantile(totals.plan_ms, 0.5),
              quantile(totals.plan_ms, 0.95));
  std::printf("robot: %.1f s a placed part\n", totals.robot_s / std::max(1, totals.placed));
  std::printf("cycle: median %.1f s, 95 %% %.1f s\n", quantile(totals.cycle_s, 0.5), quantile(totals.cycle_s, 0.95));
  std::printf("measured in the hand: %d\n", totals.measured);
  print("in the hand otherwise, or not believed", totals.in_hand);
  print("ends", totals.ends);
  print("left", totals.left);
  print("grips that held nothing", totals.grip_failures);
  print("refused grasps", totals.refused);
  return totals.collisions == 0 && totals.wrong == 0 && totals.twice == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "campaign_picking: %s\n", error.what());
  return 70;
}
