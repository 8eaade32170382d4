#include "tribin/io/convert.hpp"

#include <algorithm>

#include "io/file_bytes.hpp"
#include "io/ply_header.hpp"
#include "tribin/io/write.hpp"

namespace tribin {
namespace {

bool holds(const std::vector<std::string>& extensions, const std::string& extension) {
  return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

bool has_faces(const std::filesystem::path& path) {
  const io::FileBytes file = io::read_file(path);
  for (const io::PlyElement& element : io::parse_ply_header(file).elements) {
    if (element.name == "face" && element.count > 0) return true;
  }
  return false;
}

}  // namespace

Converted convert(const std::filesystem::path& input, const std::filesystem::path& output,
                  const ConvertOptions& options) {
  const std::string from = io::lower_extension(input), to = io::lower_extension(output);
  const bool to_mesh = holds(writable_mesh_extensions(), to), to_scan = holds(writable_scan_extensions(), to);
  if (!to_mesh && !to_scan) {
    io::bad_file(output.string(), "", "extension " + io::in_quotes(to),
                 "one to write (.ply .pcd .xyz .png .stl .obj .dxf)", ErrorCode::bad_option);
  }
  const bool may_be_scan = holds(scan_extensions(), from);
  const bool from_mesh = !may_be_scan || (from == ".ply" && to_mesh && has_faces(input));
  if (from_mesh) {
    const Mesh mesh = read_cad(input, options.cad);
    if (!to_mesh) {
      io::bad_file(output.string(), "", "a mesh as input", "a mesh format (.stl .ply .obj .dxf)",
                   ErrorCode::bad_option);
    }
    write_mesh(output, mesh);
    return {"mesh", mesh.vertices.size(), mesh.triangles.size(), mesh.warnings};
  }
  if (!to_scan) {
    io::bad_file(output.string(), "", "a scan as input", "a scan format (.ply .pcd .xyz .png)", ErrorCode::bad_option);
  }
  const ScanOrPoints content = read_scan_or_points(input, options.scan);
  if (const auto* scan = std::get_if<Scan>(&content)) {
    write_scan(output, *scan);
    return {"scan", valid_count(*scan), 0, scan->warnings};
  }
  const auto& points = std::get<PointSet>(content);
  write_points(output, points);
  return {"points", points.points.size(), 0, points.warnings};
}

}  // namespace tribin
