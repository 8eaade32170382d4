#include "commands.hpp"

namespace tribin::cli {

void add_calibrate(CLI::App& app, Context& context) {
  CLI::App* group = add_command(app, context, "calibrate", "Calibrate the camera to the robot, and check it",
                                "tribin calibrate hand-eye poses.json --mount fixed --json hand_eye.json");
  group->require_subcommand(1);
  add_calibrate_camera(*group, context);
  add_calibrate_projector(*group, context);
  add_calibrate_rig(*group, context);
  add_calibrate_hand_eye(*group, context);
  add_calibrate_touch(*group, context);
}

}  // namespace tribin::cli
