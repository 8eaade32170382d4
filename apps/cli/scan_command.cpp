#include <algorithm>
#include <cstdio>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/capture/triangulate.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/io/rig_file.hpp"
#include "tribin/io/write.hpp"
#include "tribin/report/capture_report.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string frames, calibration, list, out, report;
  DecodeOptions decode;
};

/// The frames of each rig camera, by name; by order where the rig has no such name.
std::vector<FrameStack> in_order_of(const Rig& rig, std::vector<FrameStack> frames) {
  std::vector<FrameStack> out;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const std::string& name = rig.cameras[i].name;
    auto found = std::find_if(frames.begin(), frames.end(), [&](const FrameStack& f) { return f.camera == name; });
    if (found == frames.end() && name.empty() && i < frames.size())
      found = frames.begin() + static_cast<std::ptrdiff_t>(i);
    if (found == frames.end())
      throw Error(ErrorCode::bad_input, rig.source + ": camera " + name + ": saw no frames of it, wanted a camera \"" +
                                            name + "\" in frames.json (it has " + frames[0].camera +
                                            (frames.size() > 1 ? ", ..)" : ")"));
    out.push_back(*found);
  }
  return out;
}

int run(const Options& options, const Context&) {
  const Rig rig = read_rig(options.calibration, options.frames);
  if (rig.cameras.size() > 2)
    throw Error(ErrorCode::bad_input, rig.source + ": cameras: saw " + std::to_string(rig.cameras.size()) +
                                          ", wanted one with a projector, or two");
  const std::vector<FrameStack> frames = in_order_of(rig, read_frames(options.frames, options.list));
  std::vector<Decoded> decoded;
  for (const FrameStack& f : frames) decoded.push_back(decode(f, options.decode));
  Triangulated result = decoded.size() == 2 ? triangulate(rig, decoded[0], decoded[1]) : triangulate(rig, decoded[0]);
  Scan& scan = result.scan;
  scan.source = options.frames;
  for (const std::string& warning : scan.warnings) log(LogLevel::warning, warning);
  const std::size_t valid = valid_count(scan);
  if (valid == 0)
    throw Error(ErrorCode::too_little_data, options.frames + ": saw no pixel that could be measured (" +
                                                describe_validity(scan.invalid_reason) + "), wanted some");
  StagedOutput staged(options.out);
  write_scan(staged.path(), scan);
  staged.publish();
  if (!options.report.empty()) {
    StagedOutput folder(options.report);
    write_capture_report(folder.path(), result, decoded);
    folder.publish();
  }
  std::printf("%s: %d x %d, %zu points (%.1f %%), noise %.3f mm\n", options.out.c_str(), scan.width(), scan.height(),
              valid, 100.0 * static_cast<double>(valid) / static_cast<double>(scan.z_mm.size()), scan.noise.sigma_mm);
  return 0;
}

}  // namespace

void add_scan(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "scan", "Decode structured-light frames into a scan",
                                  "tribin scan frames --calibration rig.json -o scan.pcd --report report");
  command->add_option("FRAMES", options->frames, "Folder of the frames, with frames.json")
      ->required()
      ->type_name("DIR");
  command->add_option("--calibration", options->calibration, "rig.json, or OpenCV's YAML of two cameras")
      ->required()
      ->type_name("FILE");
  command->add_option("-o", options->out, "Scan to write: .pcd, .ply, or .png with its camera file")
      ->required()
      ->type_name("FILE");
  command->add_option("--frames", options->list, "frames.json of a folder that has none")->type_name("FILE");
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
