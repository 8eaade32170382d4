#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "camera_source.hpp"
#include "cell_view.hpp"
#include "tribin/config/robot_file.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/grasp/grasp.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/picking/vision.hpp"
#include "tribin/robot/cell_limits.hpp"
#include "tribin/robot/text_protocol.hpp"

namespace tribin::cli {
namespace {

using robot::TextPick;
using robot::TextScene;
using robot::TextStatus;

struct Options {
  SourceArguments from;
  std::string cell, calibration, address = "127.0.0.1", key, scan_unit = "auto";
  int port = 7000;
  double seconds = 0;
  bool any_age = false, allow_remote = false, no_cache = false;
};

constexpr double kApproach_mm = 100;  // before the pick, back along the tool
constexpr double kLift_mm = 150;      // after it, straight up

/// A planned grasp as the three poses that a robot's program is given. \return none where its way in takes a fourth:
/// from above into a bin, then aslant
std::optional<TextPick> planned_pick(const grasp::Grasp& grasp) {
  if (grasp.at(grasp::Step::entry)) return {};
  TextPick pick;
  pick.pick = {grasp.at(grasp::Step::pre_pick)->base_from_tcp, grasp.at(grasp::Step::pick)->base_from_tcp,
               grasp.at(grasp::Step::retreat)->base_from_tcp};
  return pick;
}

/// The best taught pick point of one part in one of its equivalent poses: greatest priority, then least tilt.
std::optional<TextPick> taught_pick(const CellPart& part, const std::vector<Pose>& base_from_part) {
  std::optional<TextPick> best;
  double best_priority = 0, best_tilt = 0;
  for (const PickPoint& point : part.pick_points)
    for (const Pose& pose : base_from_part) {
      const Pose at = pose * point.part_from_tcp;
      const double tilt = std::acos(std::clamp(-at.linear()(2, 2), -1.0, 1.0));  // of the approach to straight down
      if (tilt > part.max_tilt_rad) continue;
      if (best && (point.priority < best_priority || (point.priority == best_priority && tilt >= best_tilt))) continue;
      TextPick pick;
      pick.pick.fill(at);
      pick.pick[0].translation() -= kApproach_mm * at.linear().col(2);
      pick.pick[2].translation().z() += kLift_mm;
      best = pick;
      best_priority = point.priority;
      best_tilt = tilt;
    }
  return best;
}

class Vision {
 public:
  Vision(const Options& options, const WorkCell& cell) : options_(options), cell_(cell) {
    parts_ = read_parts_of(cell, options.no_cache);
    for (std::size_t i = 0; i < parts_.size() && !cell.grippers.empty(); ++i) {
      known_.push_back(grasp::prepare_grasps(parts_[i], cell.parts[i], cell.grippers));
      for (const std::string& warning : known_.back().warnings) log(LogLevel::warning, warning);
    }
    if (!cell.robots.empty()) robot_ = read_robot(cell.robots.front().model);
    if (std::filesystem::is_regular_file(options.from.source)) return;  // a scan, read anew each time
    if (!options.calibration.empty()) rig_ = read_rig(options.calibration, options.from.source);
    camera_ = open_source(options.from);
  }

  TextScene look() const {
    const Scan scan = take();
    const std::optional<std::int64_t> now = options_.any_age ? std::nullopt : std::optional(now_ms());
    const Pose base_from_input = base_from_camera(cell_, scan.taken, options_.from.source, now);
    FinderOptions finder;
    if (cell_.bin) finder.bin = known_bin(cell_, scan);
    const Found found = find_parts(scan, parts_, finder);
    TextScene scene;
    scene.status = found.status == "empty"         ? TextStatus::bin_empty
                   : found.instances.items.empty() ? TextStatus::no_object
                                                   : TextStatus::not_pickable;
    const Pose base_from_scan = base_from_input * scan.input_from_camera;
    if (known_.empty())
      add_taught(found, base_from_scan, scene);
    else
      add_planned(scan, found, base_from_scan, scene);
    if (!scene.picks.empty()) scene.status = TextStatus::scanned;
    return scene;
  }

 private:
  /// The best grasp of each part, best first. Cells with grippers have them planned, checked against all that is known.
  void add_planned(const Scan& scan, const Found& found, const Pose& base_from_scan, TextScene& scene) const {
    grasp::Scene seen = grasp::scene_of(cell_, scan, base_from_scan, found.instances, known_);
    if (robot_) seen.arm = grasp::ArmHere{&*robot_, &picking::arm_of(cell_, *robot_), 0, {}};
    for (const grasp::Grasp& grasp : grasp::plan_grasps(seen).grasps) {
      const bool has_one = std::any_of(scene.picks.begin(), scene.picks.end(),
                                       [&](const TextPick& pick) { return pick.id == grasp.id; });
      std::optional<TextPick> pick = planned_pick(grasp);
      if (has_one || !pick) continue;
      add(grasp.id, grasp.part_name, *pick, scene);
    }
  }

  /// Without a gripper in the cell: the taught points as they are, unchecked.
  void add_taught(const Found& found, const Pose& base_from_scan, TextScene& scene) const {
    for (const Instance& instance : found.instances.items) {
      std::vector<Pose> poses{base_from_scan * instance.camera_from_part};
      for (const Pose& other : instance.equivalent_poses) poses.push_back(base_from_scan * other);
      const auto part = std::find_if(cell_.parts.begin(), cell_.parts.end(),
                                     [&](const CellPart& p) { return p.name == instance.part; });
      if (const std::optional<TextPick> pick = taught_pick(*part, poses)) add(instance.id, instance.part, *pick, scene);
    }
  }

  void add(int id, const std::string& part, TextPick pick, TextScene& scene) const {
    const auto at =
        std::find_if(cell_.parts.begin(), cell_.parts.end(), [&](const CellPart& p) { return p.name == part; });
    pick.id = id;
    pick.part_class = static_cast<int>(at - cell_.parts.begin()) + 1;
    scene.picks.push_back(pick);
  }

  Scan take() const {
    if (!camera_) return read_scan_logged(options_.from.source, cell_.camera->file.string(), options_.scan_unit);
    Shot shot = camera_->grab();
    apply_taken(options_.from, shot);
    Scan scan = scan_of(std::move(shot), rig_).result.scan;
    for (const std::string& warning : scan.warnings) log(LogLevel::warning, warning);
    return scan;
  }

  const Options& options_;
  const WorkCell& cell_;
  std::vector<Part> parts_;
  std::vector<grasp::GraspPart> known_;  ///< empty where the cell has no gripper
  std::optional<robot::RobotModel> robot_;
  std::optional<Rig> rig_;
  std::unique_ptr<Camera> camera_;
};

robot::TextOptions text_options(const Options& options, const WorkCell& cell) {
  robot::TextOptions out;
  out.key = options.key;
  out.limits = robot::limits_of(cell);
  out.limits.allow_remote_clients = options.allow_remote;
  return out;
}

int run(const Options& options, const Context&) {
  const WorkCell cell = read_work_cell_logged(options.cell);
  if (cell.parts.empty()) throw Error(ErrorCode::bad_input, options.cell + ": saw no [[part]], wanted at least one");
  if (!cell.safety.workspace_mm)
    throw Error(ErrorCode::bad_input,
                options.cell + ": saw no safety.workspace_mm, wanted the box in which poses may be given out");
  for (const CellPart& part : cell.parts)
    if (part.pick_points.empty() && cell.grippers.empty())
      log(LogLevel::warning, "part " + part.name + " has no pick_points: it is found, and never given out");
  const Vision vision(options, cell);
  robot::TextVision callbacks;
  callbacks.scan = [&vision] { return vision.look(); };
  callbacks.report = [](int scene, const TextPick& pick, int result) {
    log(LogLevel::info,
        "scene " + std::to_string(scene) + ", pick " + std::to_string(pick.id) + ": result " + std::to_string(result));
  };
  const robot::TextServer server(callbacks, text_options(options, cell), options.address, options.port);
  std::printf("robot-server at %s, port %d; Ctrl-C ends it\n", options.address.c_str(), server.port());
  std::fflush(stdout);
  const auto begin = std::chrono::steady_clock::now();
  while (options.seconds == 0 ||
         std::chrono::steady_clock::now() - begin < std::chrono::duration<double>(options.seconds))
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return 0;
}

}  // namespace

void add_robot_server(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(app, context, "robot-server", "Give poses to a robot program of any brand, as lines of text",
                  "tribin robot-server bin.pcd --workcell cell.toml --port 7000");
  command->add_option("--workcell", options->cell, "Camera, hand-eye, parts with their pick points, workspace")
      ->required()
      ->type_name("TOML");
  add_live_source_arguments(command, options->from, options->calibration, options->scan_unit, "request", context);
  command->add_option("--port", options->port, "0 = any free one")->check(CLI::Range(0, 65535))->type_name("N");
  command
      ->add_option("--address", options->address,
                   "Where to listen; others than this machine need --allow-remote and --key")
      ->type_name("IP");
  command->add_flag("--allow-remote", options->allow_remote, "Robots on the network may ask, with the key");
  command->add_option("--key", options->key, "That robot programs show in HELLO")->type_name("KEY");
  command->add_flag("--any-age", options->any_age,
                    "For trials with recorded scans: take one however old, or without a time");
  command->add_option("--seconds", options->seconds, "End after that time; 0 = never")
      ->check(CLI::Range(0.0, 1e6))
      ->type_name("S");
  add_no_cache(command, options->no_cache);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
