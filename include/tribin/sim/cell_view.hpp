#pragma once

#include <optional>

#include "tribin/config/work_cell.hpp"
#include "tribin/sim/dataset.hpp"

namespace tribin::sim {

/// Camera and bin of a cell as the simulator takes them.
/// \throws Error bad_input where the cell has no bin, the camera file no size or a distortion (the simulated camera is
/// a pinhole), or the camera is on the flange and nobody says where that was.
CellView cell_view_of(const WorkCell& cell, const std::optional<Pose>& base_from_flange = {});

}  // namespace tribin::sim
