#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/config/work_cell.hpp"
#ifdef TRIBIN_WITH_SIM
#include "tribin/sim/dataset.hpp"
#endif

namespace tribin::cli {

/// Reads a work cell; its warnings go to the log.
WorkCell read_work_cell_logged(const std::filesystem::path& file);

/// The CAD of the cell's parts, with their names. \throws Error bad_input where it has none.
std::vector<Mesh> meshes_of(const WorkCell& cell);

#ifdef TRIBIN_WITH_SIM
/// Camera and bin of a cell as the simulator takes them. \throws Error bad_input where the cell has no bin, the camera
/// file no size or a distortion (the simulated camera is a pinhole), or the camera is on the flange and nobody says
/// where that was.
sim::CellView cell_view_of(const WorkCell& cell, const std::optional<Pose>& base_from_flange);
#endif

}  // namespace tribin::cli
