#pragma once

#include "sim/drawn_scene.hpp"
#include "tribin/capture/decode.hpp"
#include "tribin/capture/rig.hpp"

namespace tribin::sim {

/// A drawn scene as a camera takes it under a Gray code set, one diffuse bounce included, and the rig that takes it.
struct SceneFrames {
  FrameStack frames;
  Rig rig;
};
SceneFrames frames_of(const DrawnScene& drawn, std::uint64_t seed);

/// The seed of a data set's scene, counted from 1.
std::uint64_t seed_of_scene(std::uint64_t seed, int scene);

}  // namespace tribin::sim
