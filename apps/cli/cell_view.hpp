#pragma once

#include <filesystem>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/part/part.hpp"

namespace tribin::cli {

/// Reads a work cell; its warnings go to the log.
WorkCell read_work_cell_logged(const std::filesystem::path& file);

/// The cell's parts compiled, in its order, as read_parts does.
std::vector<Part> read_parts_of(const WorkCell& cell, bool no_cache);

/// The CAD of the cell's parts, with their names. \throws Error bad_input where it has none.
std::vector<Mesh> meshes_of(const WorkCell& cell);

}  // namespace tribin::cli
