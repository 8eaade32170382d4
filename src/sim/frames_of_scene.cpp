#include "sim/frames_of_scene.hpp"

#include "sim/random.hpp"
#include "tribin/sim/render_frames.hpp"

namespace tribin::sim {

SceneFrames frames_of(const DrawnScene& drawn, std::uint64_t seed) {
  RenderOptions render;
  render.bounce_rays = 16;  // grain of 2 grey levels at most, and only where a bounce is strong; 10 s a scene
  PatternOptions patterns;
  patterns.width = render.projector_width;
  patterns.height = render.projector_height;
  patterns.period_px = drawn.sensor.fringe_period_px;
  patterns.steps = drawn.sensor.steps;
  render.patterns = make_patterns(patterns);
  return {render_frames(drawn.bodies, drawn.sensor, render, seed), rig_of(drawn.sensor, render)};
}

std::uint64_t seed_of_scene(std::uint64_t seed, int scene) {
  return mixed(seed * 1000003u + static_cast<std::uint64_t>(scene));
}

}  // namespace tribin::sim
