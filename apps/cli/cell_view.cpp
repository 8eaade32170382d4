#include "cell_view.hpp"

#include "commands.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin::cli {

WorkCell read_work_cell_logged(const std::filesystem::path& file) {
  WorkCell cell = read_work_cell(file);
  for (const std::string& warning : cell.warnings) log(LogLevel::warning, file.filename().string() + ": " + warning);
  return cell;
}

std::vector<Part> read_parts_of(const WorkCell& cell, bool no_cache) {
  std::vector<Part> out;
  for (const CellPart& part : cell.parts)
    for (Part& read : read_parts({{part.name, part.cad}}, part.unit, no_cache)) {
      if (part.free_spin) declare_free_spin(read);
      out.push_back(std::move(read));
    }
  return out;
}

std::vector<Mesh> meshes_of(const WorkCell& cell) {
  if (cell.parts.empty())
    throw Error(ErrorCode::bad_input, cell.file.string() + ": saw no [[part]], wanted one at least");
  std::vector<Mesh> out;
  for (const CellPart& part : cell.parts) {
    out.push_back(read_cad(part.cad, {.unit = length_unit_from_name(part.unit)}));
    out.back().name = part.name;
  }
  return out;
}

}  // namespace tribin::cli
