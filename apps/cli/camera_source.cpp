#include "camera_source.hpp"

#include "cell_view.hpp"
#include "tribin/camera/folder_camera.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/io/taken_file.hpp"
#ifdef TRIBIN_WITH_SIM
#include "tribin/sim/cell_view.hpp"
#include "tribin/sim/simulated_camera.hpp"
#endif
#ifdef TRIBIN_WITH_GENICAM
#include "tribin/genicam/genicam_camera.hpp"
#endif

namespace tribin::cli {
namespace {

constexpr const char *kSim = "sim:", *kGenicam = "genicam";

bool begins_with(const std::string& text, const std::string& head) { return text.compare(0, head.size(), head) == 0; }

/// The pose that is given, without its time.
Taken taken_of(const SourceArguments& arguments) {
  Taken taken;
  if (!arguments.flange.empty()) taken.base_from_flange = robot_pose_from_text(arguments.flange);
  return taken;
}

#ifdef TRIBIN_WITH_SIM
std::unique_ptr<Camera> open_sim(const SourceArguments& arguments) {
  const Taken taken = taken_of(arguments);
  const WorkCell cell = read_work_cell_logged(arguments.source.substr(std::string(kSim).size()));
  return sim::open_simulated_camera(
      sim::cell_view_of(cell, taken.base_from_flange), meshes_of(cell),
      {.level = sim::level_of(arguments.level), .seed = arguments.seed, .frames = arguments.rendered, .taken = taken});
}
#else
std::unique_ptr<Camera> open_sim(const SourceArguments&) { refuse_without_simulation(); }
#endif

#ifdef TRIBIN_WITH_GENICAM
std::unique_ptr<Camera> open_genicam(const SourceArguments& arguments) {
  genicam::GenicamOptions options;
  const std::string head = std::string(kGenicam) + ":";
  if (begins_with(arguments.source, head)) options.id = arguments.source.substr(head.size());
  if (!arguments.patterns.empty()) options.sequence = read_sequence(arguments.patterns);
  options.trigger = !arguments.trigger.empty()   ? genicam::trigger_of(arguments.trigger)
                    : arguments.patterns.empty() ? genicam::Trigger::free_run
                                                 : genicam::Trigger::hardware;
  options.line = arguments.line;
  options.exposure_ms = arguments.exposure_ms;
  options.timeout_s = arguments.timeout_s;
  options.packet_size = arguments.packet_size;
  options.packet_socket = !arguments.no_packet_socket;
  options.retries = arguments.retries;
  options.taken = taken_of(arguments);
  return genicam::open_genicam_camera(options);
}
#else
std::unique_ptr<Camera> open_genicam(const SourceArguments&) {
  throw Error(ErrorCode::bad_option, "GenICam cameras are not built in; install libaravis-dev and build again");
}
#endif

}  // namespace

void add_source_arguments(CLI::App* command, SourceArguments& a, Context& context) {
  command
      ->add_option("SOURCE", a.source,
                   "Folder of frames (frames.json) or of recorded shots; sim:CELL.toml, the simulated camera of a work "
                   "cell; genicam[:ID], a camera")
      ->required()
      ->type_name("FRAMES_DIR|sim:CELL|genicam[:ID]");
  command->add_option("--frames", a.frames_file, "frames.json of a folder that has none")->type_name("FILE");
  command
      ->add_option(
          "--base-from-flange", a.flange,
          "Where the robot held the camera: a maker's convention and its numbers, \"yaskawa 600 0 900 180 0 0\"")
      ->type_name("POSE");
  command->add_option("--flange-time", a.flange_time, "When the robot told it; left out: the time of the scan")
      ->type_name("TIME");
  command->add_option("--taken", a.taken, "When the frames were taken, 2026-11-22T11:15:03.250Z; cameras know it")
      ->type_name("TIME");
  command->add_option("--level", a.level, "sim: easy, dense, hard")->type_name("L");
  command->add_option("--seed", a.seed, "sim: the same seed gives the same scene")->type_name("S");
  command->add_flag("--rendered", a.rendered, "sim: render the frames and decode them; left out: the fast mode");
  command
      ->add_option("--patterns", a.patterns,
                   "genicam: frames.json (or its folder) of the set that the projector shows; left out: Coord3D")
      ->type_name("FILE");
  command
      ->add_option("--trigger", a.trigger,
                   "genicam: hardware (with patterns), software, software_burst, free_run (without)")
      ->type_name("T");
  command->add_option("--trigger-line", a.line, "genicam: input of the hardware trigger")->type_name("LINE");
  command->add_option("--exposure-ms", a.exposure_ms, "genicam: 0 = as the camera is set")
      ->check(CLI::Range(0.0, 60000.0))
      ->type_name("T");
  command->add_option("--timeout-s", a.timeout_s, "genicam: for each picture, beyond its exposure")
      ->check(CLI::Range(0.01, 3600.0))
      ->type_name("T");
  command->add_option("--retries", a.retries, "genicam: how often a burst with incomplete pictures is taken again")
      ->check(CLI::Range(0, 1000))
      ->type_name("N");
  only_experts(command->add_option("--packet-size", a.packet_size)->check(CLI::Range(0, 65535)), context);
  only_experts(command->add_flag("--no-packet-socket", a.no_packet_socket), context);
}

void add_live_source_arguments(CLI::App* command, SourceArguments& a, std::string& calibration, std::string& scan_unit,
                               const std::string& each, Context& context) {
  a.source = "genicam";
  add_source_arguments(command, a, context);
  command->get_option("SOURCE")->required(false)->description(
      "A scan file, read anew at each " + each +
      "; or a camera as of tribin scan: FRAMES_DIR, sim:CELL.toml, genicam[:ID] (default)");
  command->add_option("--calibration", calibration, "rig.json of a camera that gives frames")->type_name("FILE");
  command->add_option("--scan-unit,--depth-unit", scan_unit, "Of clouds and of depth images of floats: auto, mm, m")
      ->type_name("U");
}

std::unique_ptr<Camera> open_source(const SourceArguments& arguments) {
  if (begins_with(arguments.source, kSim)) return open_sim(arguments);
  if (arguments.source == kGenicam || begins_with(arguments.source, std::string(kGenicam) + ":"))
    return open_genicam(arguments);
  return open_folder_camera(arguments.source, arguments.frames_file);
}

void apply_taken(const SourceArguments& arguments, Shot& shot) {
  const auto time_of = [](const std::string& option, const std::string& text) {
    try {
      return time_from_text(text);
    } catch (const Error& e) {
      throw Error(ErrorCode::bad_option, option + ": " + e.what());
    }
  };
  if (!arguments.taken.empty()) shot.taken.time_ms = time_of("--taken", arguments.taken);
  if (!arguments.flange.empty()) {
    shot.taken.base_from_flange = robot_pose_from_text(arguments.flange);
    shot.taken.flange_time_ms = shot.taken.time_ms;
  }
  if (!arguments.flange_time.empty()) shot.taken.flange_time_ms = time_of("--flange-time", arguments.flange_time);
  if (!arguments.flange.empty() && !shot.taken.time_ms)
    throw Error(ErrorCode::bad_option, "--base-from-flange: " + arguments.source +
                                           " does not say when it was taken; wanted --taken TIME beside the pose");
}

}  // namespace tribin::cli
