#pragma once

#include <memory>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/camera/camera.hpp"
#include "tribin/sim/dataset.hpp"

namespace tribin::sim {

struct SimulatedCameraOptions {
  Level level = Level::easy;  ///< how many parts, how noisy where the cell's camera file does not say
  std::uint64_t seed = 1;     ///< of the first scene; the next ones follow it
  bool frames = false;        ///< pictures of a Gray code set, rendered, in place of a scan by the fast mode
  Taken taken = {};           ///< of each shot: base_from_flange of a camera on the flange; its time is the clock's
};

/// A camera that finds a new heap in its bin at each shot: what `simulate --kind bin` makes of the cell with the same
/// seed. Frames come with the rig that took them (Shot::rig).
/// \param parts  with their names; moved in.
std::unique_ptr<Camera> open_simulated_camera(CellView cell, std::vector<Mesh> parts,
                                              const SimulatedCameraOptions& options = {});

}  // namespace tribin::sim
