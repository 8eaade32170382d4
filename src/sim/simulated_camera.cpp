#include "tribin/sim/simulated_camera.hpp"

#include "sim/frames_of_scene.hpp"

namespace tribin::sim {
namespace {

class SimulatedCamera : public Camera {
 public:
  SimulatedCamera(CellView cell, std::vector<Mesh> parts, const SimulatedCameraOptions& options)
      : cell_(std::move(cell)),
        parts_(std::move(parts)),
        options_(options),
        stock_(make_stock(parts_, SceneKind::bin, settings_of(options.level))) {}

  std::string name() const override { return "sim"; }

  Shot grab() override {
    Shot shot;
    shot.taken = options_.taken;
    shot.taken.time_ms = now_ms();
    if (shot.taken.base_from_flange) shot.taken.flange_time_ms = shot.taken.time_ms;
    const std::uint64_t seed = seed_of_scene(options_.seed, ++scene_);
    const DrawnScene drawn = draw_bin_scene(stock_, SceneKind::bin, settings_of(options_.level), seed, cell_);
    if (!options_.frames) {
      shot.content = simulate_scan(drawn.bodies, drawn.sensor, seed).scan;
      return shot;
    }
    SceneFrames taken = frames_of(drawn, seed);
    shot.content = std::vector<FrameStack>{std::move(taken.frames)};
    shot.rig = std::move(taken.rig);
    return shot;
  }

 private:
  CellView cell_;
  std::vector<Mesh> parts_;
  SimulatedCameraOptions options_;
  SceneStock stock_;
  int scene_ = 0;
};

}  // namespace

std::unique_ptr<Camera> open_simulated_camera(CellView cell, std::vector<Mesh> parts,
                                              const SimulatedCameraOptions& options) {
  return std::make_unique<SimulatedCamera>(std::move(cell), std::move(parts), options);
}

}  // namespace tribin::sim
