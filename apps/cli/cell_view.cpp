#include "cell_view.hpp"

#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin::cli {

WorkCell read_work_cell_logged(const std::filesystem::path& file) {
  WorkCell cell = read_work_cell(file);
  for (const std::string& warning : cell.warnings) log(LogLevel::warning, file.filename().string() + ": " + warning);
  return cell;
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
