#include <cstdio>

#include "camera_source.hpp"
#include "output.hpp"
#include "tribin/camera/folder_camera.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/io/write.hpp"
#include "tribin/report/capture_report.hpp"

namespace tribin::cli {
namespace {

struct Options {
  SourceArguments from;
  std::string calibration, out, report, record;
  DecodeOptions decode;
};

int run(const Options& options, const Context&) {
  std::optional<Rig> rig;
  if (!options.calibration.empty()) rig = read_rig(options.calibration, options.from.source);
  Shot shot = open_source(options.from)->grab();
  apply_taken(options.from, shot);
  if (!options.record.empty()) record_shot(options.record, shot);
  const ShotScan taken = scan_of(std::move(shot), rig, options.decode);
  const Scan& scan = taken.result.scan;
  for (const std::string& warning : scan.warnings) log(LogLevel::warning, warning);
  const std::size_t valid = valid_count(scan);
  if (valid == 0)
    throw Error(ErrorCode::too_little_data, options.from.source + ": saw no pixel that could be measured (" +
                                                describe_validity(scan.invalid_reason) + "), wanted some");
  if (!options.report.empty() && taken.decoded.empty())
    throw Error(ErrorCode::bad_option, "--report shows phase and modulation of frames; " + options.from.source +
                                           " gives a scan (sim: --rendered gives frames)");
  StagedOutput staged(options.out);
  write_scan(staged.path(), scan);
  staged.publish();
  if (!options.report.empty()) {
    StagedOutput folder(options.report);
    write_capture_report(folder.path(), taken.result, taken.decoded);
    folder.publish();
  }
  std::printf("%s: %d x %d, %zu points (%.1f %%)", options.out.c_str(), scan.width(), scan.height(), valid,
              100.0 * static_cast<double>(valid) / static_cast<double>(scan.z_mm.size()));
  if (scan.noise.sigma_mm > 0) std::printf(", noise %.3f mm", scan.noise.sigma_mm);
  std::printf("\n");
  return 0;
}

}  // namespace

void add_scan(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(
      app, context, "scan", "Take a scan: from structured-light frames, the simulated camera, or a GenICam camera",
      "tribin scan frames --calibration rig.json -o scan.pcd --report report\n"
      "  tribin scan sim:examples/cells/bench_cell.toml -o scan.pcd\n"
      "  tribin scan genicam --patterns patterns --calibration rig.json -o scan.pcd --record shots");
  add_source_arguments(command, options->from, context);
  command
      ->add_option("--calibration", options->calibration, "rig.json, or OpenCV's YAML of two cameras; frames need it")
      ->type_name("FILE");
  command->add_option("--record", options->record, "Folder to which the shot is added, to be replayed as SOURCE")
      ->type_name("DIR");
  command->add_option("-o", options->out, "Scan to write: .pcd, .ply, or .png with its camera file")
      ->required()
      ->type_name("FILE");
  command->add_option("--report", options->report, "Folder for pictures of phase, modulation, validity and depth")
      ->type_name("DIR");
  command->add_option("--full-scale", options->decode.full_scale, "Grey value that is saturated; 0 = 255 or 65535")
      ->check(CLI::Range(0.0, 65535.0))
      ->type_name("G");
  only_experts(command->add_option("--image-noise", options->decode.image_noise), context);
  only_experts(command->add_option("--min-modulation", options->decode.min_modulation), context);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
