#pragma once

#include <filesystem>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/config/work_cell.hpp"

namespace tribin::cli {

/// Reads a work cell; its warnings go to the log.
WorkCell read_work_cell_logged(const std::filesystem::path& file);

/// The CAD of the cell's parts, with their names. \throws Error bad_input where it has none.
std::vector<Mesh> meshes_of(const WorkCell& cell);

}  // namespace tribin::cli
