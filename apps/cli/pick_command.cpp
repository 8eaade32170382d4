#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>

#include "camera_source.hpp"
#include "cell_view.hpp"
#include "tribin/config/robot_file.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/picking/report.hpp"
#include "tribin/robot/cell_limits.hpp"
#include "tribin/robot/hses.hpp"
#include "tribin/robot/nx100.hpp"
#include "tribin/robot/watchdog.hpp"
#ifdef TRIBIN_WITH_SIM
#include "tribin/sim/work_cell.hpp"
#endif

namespace tribin::cli {
namespace {

struct Options {
  SourceArguments from;
  std::string cell, calibration, scan_unit = "auto", journal, answer, json = "-", report;
  int simulate = 0, most_parts = 0;
  bool arm = false, dry_run = false, new_rack = false, recover = false, any_age = false, no_cache = false,
       confirm_tools = false;
};

/// A scan file as a camera: read anew at each shot, for trials.
class FileCamera : public Camera {
 public:
  FileCamera(std::string file, std::string camera, std::string unit)
      : file_(std::move(file)), camera_(std::move(camera)), unit_(std::move(unit)) {}
  std::string name() const override { return file_; }
  Shot grab() override {
    Scan scan = read_scan_logged(file_, camera_, unit_);
    Shot shot;
    shot.taken = scan.taken;
    shot.content = std::move(scan);
    return shot;
  }

 private:
  std::string file_, camera_, unit_;
};

/// All that a run needs, from hardware or from the simulation.
struct Cell {
  WorkCell cell;
  robot::RobotModel robot;
  std::vector<Part> parts;
  std::optional<Rig> rig;
#ifdef TRIBIN_WITH_SIM
  std::unique_ptr<sim::SimulatedCell> simulated;
#endif
  std::unique_ptr<Camera> own_camera;
  Camera* camera = nullptr;
  std::unique_ptr<robot::Clock> own_clock;
  robot::Clock* clock = nullptr;
};

void open_simulated(Cell& cell, const Options& options) {
#ifdef TRIBIN_WITH_SIM
  std::vector<Mesh> meshes;
  for (const Part& part : cell.parts) meshes.push_back(part.mesh);
  sim::SimulatedCellOptions simulation;
  simulation.seed = options.from.seed;
  simulation.parts = options.simulate;
  cell.simulated =
      std::make_unique<sim::SimulatedCell>(cell.cell, cell.robot, sim::make_cell_stock(std::move(meshes)), simulation);
  cell.camera = &cell.simulated->camera();
  cell.clock = &cell.simulated->clock();
#else
  (void)cell, (void)options;
  refuse_without_simulation();
#endif
}

Cell open_cell(const Options& options) {
  Cell cell;
  cell.cell = read_work_cell_logged(options.cell);
  if (cell.cell.robots.empty())
    throw Error(ErrorCode::bad_input, options.cell + ": saw no [[robot]], wanted the one that picks");
  cell.robot = read_robot(cell.cell.robots.front().model);
  cell.parts = read_parts_of(cell.cell, options.no_cache);
  if (options.simulate > 0) {
    open_simulated(cell, options);
    return cell;
  }
  cell.own_clock = robot::make_clock();
  cell.clock = cell.own_clock.get();
  if (std::filesystem::is_regular_file(options.from.source)) {
    cell.own_camera =
        std::make_unique<FileCamera>(options.from.source, cell.cell.camera->file.string(), options.scan_unit);
  } else {
    if (!options.calibration.empty()) cell.rig = read_rig(options.calibration, options.from.source);
    cell.own_camera = open_source(options.from);
  }
  cell.camera = cell.own_camera.get();
  return cell;
}

std::unique_ptr<robot::Controller> connect(const Cell& cell) {
#ifdef TRIBIN_WITH_SIM
  if (cell.simulated) return cell.simulated->connect();
#endif
  const CellController& at = cell.cell.robots.front().controller;
  switch (at.kind) {
    case ControllerKind::nx100:
      return robot::make_nx100(robot::tcp_stream(at.address, at.port, *cell.clock), *cell.clock);
    case ControllerKind::hses:
      return robot::make_hses(robot::udp_link(at.address, at.port, *cell.clock), *cell.clock);
    default:
      throw Error(ErrorCode::bad_input, cell.cell.file.string() +
                                            ": robot[0].controller.kind: saw \"text\", wanted nx100 or hses: robots of "
                                            "the text protocol are served by tribin robot-server");
  }
}

/// The watchdog of a robot on a real clock: it reads the status while the robot moves, and holds it.
class Guard {
 public:
  Guard(std::unique_ptr<robot::Controller> controller, Cell& cell, const robot::SafetyLimits& limits, bool threads) {
    const auto kept_back = [](const std::string& what) { log(LogLevel::warning, what); };
    clock_ = cell.clock;
    moves_to_look_ = cell.cell.mount() == CameraMount::hand;
    if (!threads) {  // the simulated cell lives on one thread; the cycle looks at the status itself
      guarded_ = make_guarded(std::move(controller), limits, true, kept_back);
      return;
    }
    auto queue = make_queue(std::move(controller), *cell.clock);
    robot::ControllerQueue& link = *queue;
    guarded_ = make_guarded(std::move(queue), limits, true, kept_back);
    watchdog_ = std::make_unique<robot::Watchdog>(
        link, *cell.clock, [this] { return facts(); }, robot::WatchLimits{},
        [](const std::string& reason, bool held) {
          log(LogLevel::warning,
              (held ? "the robot was put on hold: " : "the robot could not be put on hold: ") + reason);
        });
  }

  robot::Controller& controller() { return *guarded_; }

  void enter(picking::Phase phase) {
    heard_s_ = clock_->now_s();
    // What is in the hand or at the station does not lie where a scan saw it.
    if (phase == picking::Phase::scan || phase == picking::Phase::recover || phase == picking::Phase::place ||
        phase == picking::Phase::regrasp)
      scan_s_ = clock_->now_s();
    const bool moves = phase == picking::Phase::pick || phase == picking::Phase::place ||
                       phase == picking::Phase::regrasp || phase == picking::Phase::push ||
                       (phase == picking::Phase::scan && moves_to_look_);
    if (watchdog_) watchdog_->watch(moves);
  }

  /// Asked at each poll of the hand-shake, on any clock.
  bool may_go_on(const robot::ControllerStatus&) {
    heard_s_ = clock_->now_s();
    robot::WatchFacts now = facts();
    now.now_s = now.status_s = clock_->now_s();
    return hold_reason(now).empty();
  }

 private:
  robot::WatchFacts facts() const {
    robot::WatchFacts facts;
    facts.client_s = heard_s_;
    facts.scan_s = scan_s_;
    return facts;
  }

  robot::Clock* clock_ = nullptr;
  bool moves_to_look_ = false;  // the camera is on the flange
  std::atomic<double> heard_s_{0}, scan_s_{0};
  std::unique_ptr<robot::Controller> guarded_;
  std::unique_ptr<robot::Watchdog> watchdog_;  // ends before the controller does
};

/// Lines to a file or to stdout, each at once: a reader may wait for them.
class Lines {
 public:
  explicit Lines(const std::string& where) {
    if (where == "-") return;
    file_.open(where);
    if (!file_) throw Error(ErrorCode::bad_option, "--json " + where + ": cannot be written");
  }
  void write(const std::string& line) { (file_.is_open() ? file_ : std::cout) << line << std::endl; }

 private:
  std::ofstream file_;
};

std::filesystem::path journal_of(const Options& options) {
  if (!options.journal.empty()) return options.journal;
  // A simulated heap is a new one in each run, and so is its rack.
  if (options.simulate > 0)
    return std::filesystem::temp_directory_path() / ("tribin_pick_" + std::to_string(::getpid()) + ".ndjson");
  return std::filesystem::path(options.cell).replace_extension(".journal.ndjson");
}

robot::SafetyLimits limits_for(const Cell& cell, const Options& options) {
  robot::SafetyLimits limits = robot::limits_of(cell.cell);
  const bool confirmed = options.confirm_tools || options.simulate > 0 || !options.arm;
  for (std::size_t i = 0; confirmed && i < cell.cell.grippers.size(); ++i) limits.tools.insert(static_cast<int>(i) + 1);
  return limits;
}

picking::Filling known_filling(const Options& options, std::size_t slots) {
  picking::JournalState state;
  state.filling.resize(slots);
  std::ifstream file(journal_of(options), std::ios::binary);
  std::stringstream text;
  if (file) text << file.rdbuf();
  for (const picking::Entry& entry : picking::entries_of(text.str(), journal_of(options).string()))
    follow(state, entry, journal_of(options).string());
  return state.filling;
}

int dry_run(Cell& cell, picking::Vision& vision, const Options& options) {
  const picking::Filling filling =
      known_filling(options, cell.cell.rack ? picking::slots_of(*cell.cell.rack).size() : 0);
  // A camera on the flange looks from where that stands: asked of the controller, unless the record tells it.
  picking::FlangePose flange;
  if (cell.cell.mount() == CameraMount::hand)
    flange = [&cell] {
      const robot::CartesianPosition at = connect(cell)->position();
      const auto tool = std::clamp<std::size_t>(static_cast<std::size_t>(at.tool), 1, cell.cell.grippers.size()) - 1;
      return Pose(robot::pose_of(at) * cell.cell.grippers[tool].flange_from_tcp.inverse());
    };
  const picking::CycleReport report =
      plan_first(cell.cell, cell.robot, vision, filling, limits_for(cell, options), flange);
  Lines(options.json).write(line_of(report));
  if (!options.report.empty()) {
    picking::RunPage page(options.report);
    if (vision.last_scan()) page.show(picking::picture_of(*vision.last_scan()));
    page.add(report);
    page.finish(cell.cell, {"dry_run", "nothing was moved", 0}, filling);
  }
  log(LogLevel::info, "a dry run: nothing was moved; --arm moves the robot");
  return report.state == "planned" ? 0 : 1;
}

int work(Cell& cell, picking::Vision& vision, const Options& options) {
  if (!cell.cell.safety.allow_arm)
    throw Error(ErrorCode::bad_option, options.cell + ": saw allow_arm = false, wanted true for --arm");
  if (!cell.cell.rack) throw Error(ErrorCode::bad_input, options.cell + ": saw no [rack], wanted one to place in");
  const robot::SafetyLimits limits = limits_for(cell, options);
  if (limits.tools.empty())
    throw Error(ErrorCode::bad_option,
                "--arm wants --tools-confirmed: that tool number n of the controller is the n-th gripper of " +
                    options.cell + " (flange_from_tcp), as somebody has compared");
  Guard guard(connect(cell), cell, limits, options.simulate == 0);
  picking::Journal journal(journal_of(options), picking::slots_of(*cell.cell.rack).size());
  if (options.new_rack) {
    if (journal.state().open || journal.state().in_hand)
      throw Error(ErrorCode::bad_option, "--new-rack: saw an order whose end is not known (cycle " +
                                             std::to_string(journal.state().last_cycle) +
                                             "), wanted it settled first: run once without --new-rack");
    journal.write({});
  }
  Lines lines(options.json);
  std::optional<picking::RunPage> page;
  if (!options.report.empty()) page.emplace(options.report);
  picking::RunOptions run;
  run.recover_only = options.recover;
  run.most_parts = options.most_parts;
  if (!options.answer.empty())
    run.answer = options.answer == "full" ? picking::Answer::slot_full : picking::Answer::slot_empty;
  run.handshake.may_go_on = [&guard](const robot::ControllerStatus& status) { return guard.may_go_on(status); };
  run.entered = [&](picking::Phase phase) {
    guard.enter(phase);
    if (page && phase == picking::Phase::choose && vision.last_scan())
      page->show(picking::picture_of(*vision.last_scan()));
  };
  run.told = [&](const picking::CycleReport& report) {
    lines.write(line_of(report));
    if (page) page->add(report);
  };
  const picking::RunEnd end =
      picking::run_picking({&cell.cell, &cell.robot, &vision, &guard.controller(), cell.clock, &journal, limits}, run);
  lines.write(line_of(end, journal.state().filling));
  if (page) page->finish(cell.cell, end, journal.state().filling);
  log(LogLevel::info, end.status + ": " + end.message);
  if (end.status == "in_doubt") throw Error(ErrorCode::device, end.message);
  if (options.simulate > 0 && options.journal.empty()) std::filesystem::remove(journal_of(options));
  return end.placed > 0 || end.status == "recovered" ? 0 : 1;
}

int run(const Options& options, const Context&) {
  Cell cell = open_cell(options);
  picking::VisionParts from{&cell.cell, &cell.parts, cell.camera, &cell.robot};
  from.rig = cell.rig;
  from.any_age = options.any_age && !options.arm;
  const auto vision = open_vision(from);
  return options.arm ? work(cell, *vision, options) : dry_run(cell, *vision, options);
}

}  // namespace

void add_pick(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "pick", "Pick parts from a bin and place them in a rack",
                                  "tribin pick --workcell examples/cells/pick_cell.toml --simulate 9 --arm");
  command->add_option("--workcell", options->cell, "Camera, bin, grippers, parts, rack, robot, safety")
      ->required()
      ->type_name("TOML");
  auto* dry = command->add_flag("--dry-run", options->dry_run, "One scan and one plan; nothing moves (default)");
  command->add_flag("--arm", options->arm, "Move the robot; the cell must say safety.allow_arm = true")->excludes(dry);
  command
      ->add_option("--simulate", options->simulate,
                   "Bin with so many parts, camera, controller and arm are simulated; --seed draws another heap")
      ->check(CLI::Range(1, 200))
      ->type_name("N");
  command->add_flag("--tools-confirmed", options->confirm_tools,
                    "Tool n of the controller is the n-th gripper of the cell: somebody has compared their frames");
  command->add_option("--parts", options->most_parts, "Stop after so many")
      ->check(CLI::Range(1, 100000))
      ->type_name("N");
  command->add_option("--journal", options->journal, "What was done; left out: beside the cell's file")
      ->type_name("FILE");
  command->add_flag("--recover", options->recover, "Settle what a crash left open, and stop; wants --arm");
  command->add_flag("--new-rack", options->new_rack, "An empty rack stands there");
  command
      ->add_option(
          "--slot-is", options->answer,
          "After a run that was in doubt: the part stands in its slot (full) or not (empty); the gripper is empty")
      ->check(CLI::IsMember({"full", "empty"}))
      ->type_name("S");
  command->add_option("--json", options->json, "JSON lines, one a cycle: a file, or - for stdout (default)")
      ->type_name("OUT");
  command->add_option("--report", options->report, "Folder for a page with a film of the run")->type_name("DIR");
  add_live_source_arguments(command, options->from, options->calibration, options->scan_unit, "cycle", context);
  command->add_flag("--any-age", options->any_age, "Dry runs with recorded scans: take one however old");
  add_no_cache(command, options->no_cache);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
