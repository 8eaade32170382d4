#include <cstdio>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/hand_eye_file.hpp"
#include "tribin/report/calibration_json.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string poses, mount, json;
};

CameraMount mount_of(const Options& options, const HandEyeFile& file) {
  if (options.mount.empty() && !file.mount)
    throw Error(ErrorCode::bad_option,
                "--mount: saw neither the option nor \"mount\" in " + options.poses +
                    ", wanted fixed (the camera stands in the cell) or hand (it is on the flange)");
  if (options.mount.empty()) return *file.mount;
  const CameraMount mount = options.mount == "fixed" ? CameraMount::fixed : CameraMount::hand;
  if (file.mount && *file.mount != mount)
    throw Error(ErrorCode::bad_option,
                "--mount " + options.mount + ": " + options.poses + " says the other one; wanted the two to agree");
  return mount;
}

void print_summary(CameraMount mount, const HandEyeFile& file, const HandEye& result) {
  const Vec3 t = result.parent_from_camera.translation();
  std::printf("%s: %.3f %.3f %.3f mm, sigma %.3f mm, %.4f deg\n",
              mount == CameraMount::fixed ? "base_from_camera" : "flange_from_camera", t.x(), t.y(), t.z(),
              result.sigma_mm, result.sigma_rad / kDegree);
  std::printf("%zu of %zu pairs: rms %.3f mm, %.4f deg; each by the others: %.3f mm, %.4f deg\n",
              file.pairs.size() - result.outliers.size(), file.pairs.size(), result.rms_mm, result.rms_rad / kDegree,
              result.left_out_rms_mm, result.left_out_rms_rad / kDegree);
  std::printf("This says that the poses agree, not that the robot arrives: check it by tribin calibrate touch.\n");
}

int run(const Options& options, const Context& context) {
  const HandEyeFile file = read_hand_eye_file(options.poses);
  const CameraMount mount = mount_of(options, file);
  HandEye result;
  try {
    result = calibrate_hand_eye(file.pairs, {.mount = mount, .target = file.target, .noise = file.noise});
  } catch (const Error& e) {  // the library does not know the file
    throw Error(e.code(), options.poses + ": " + e.what());
  }
  for (const auto& [code, text] : hand_eye_warnings(file, result)) log(LogLevel::warning, text);
  if (!options.json.empty()) write_text(options.json, hand_eye_json(file, mount, result));
  if (options.json != "-" && !context.quiet) print_summary(mount, file, result);
  return 0;
}

}  // namespace

void add_calibrate_hand_eye(CLI::App& group, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      add_command(group, context, "hand-eye", "Where the camera stands to the robot, from pairs of poses",
                  "tribin calibrate hand-eye poses.json --mount fixed --json hand_eye.json");
  command->add_option("POSES.json", options->poses, "Robot and camera poses, paired by id (docs/calibration.md)")
      ->required();
  command->add_option("--mount", options->mount, "fixed: the camera stands in the cell; hand: it is on the flange")
      ->check(CLI::IsMember({"fixed", "hand"}))
      ->type_name("M");
  command->add_option("--json", options->json, "Result; - is stdout")->type_name("OUT");
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
