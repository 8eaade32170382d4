#include "io/mesh_formats.hpp"
#include "tribin/cad/polygon.hpp"

namespace tribin::io {

Mesh parse_ply_mesh(const FileBytes& file) {
  PlyContent content = parse_ply(file);
  Mesh mesh;
  if (content.polygon_sizes.empty()) {
    bad_file(file.name, "header", "points without faces", "a mesh (element face)", ErrorCode::too_little_data);
  }
  mesh.triangles.reserve(content.polygon_sizes.size());
  std::size_t at = 0, odd = 0;
  std::vector<Vec3> corners;
  for (std::uint32_t size : content.polygon_sizes) {
    const std::uint32_t* corner = content.corners.data() + at;
    at += size;
    if (size == 3) {
      mesh.triangles.push_back({corner[0], corner[1], corner[2]});
      continue;
    }
    if (size < 3) {
      ++odd;
      continue;
    }
    corners.clear();
    for (std::uint32_t i = 0; i < size; ++i) corners.push_back(content.points[corner[i]].cast<double>());
    for (const auto& t : triangulate_polygon(corners)) {
      mesh.triangles.push_back({corner[t[0]], corner[t[1]], corner[t[2]]});
    }
  }
  if (odd) mesh.warnings.push_back(std::to_string(odd) + " faces of fewer than 3 corners were left out");
  mesh.vertices = std::move(content.points);
  return mesh;
}

}  // namespace tribin::io
