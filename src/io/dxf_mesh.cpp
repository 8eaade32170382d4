#include <limits>

#include "io/dxf.hpp"
#include "io/subdivision.hpp"

namespace tribin::io {
namespace {

/// The lists of a MESH, as the file has them.
struct MeshLists {
  std::vector<Vec3> points;
  std::vector<std::int64_t> faces, edges;  ///< size, indices, size, ... ; pairs of indices
  std::vector<double> creases;             ///< one an edge; below 0 = sharp for good
  std::int64_t levels = 0, point_count = 0, face_list_size = -1, edge_count = -1, crease_count = -1;
};

MeshLists lists_of(const DxfGroups& groups, const DxfEntity& entity) {
  MeshLists m;
  bool own = false;  // groups of AcDbEntity come first, among them a 92 of another meaning (proxy graphics)
  bool in_points = false;
  for (const DxfGroup& g : entity) {
    own |= g.code == 100 && g.value == "AcDbSubDMesh";
    if (!own) continue;
    // 92, 93, 94 and 95 begin the lists of points, faces, edges and creases. What follows them are overrides of single
    // faces' colours, which use the same codes.
    if (m.crease_count >= 0) {
      if (g.code == 140) m.creases.push_back(groups.number(g));
      if (g.code == 90) break;
    } else if (g.code == 91 && !in_points) {
      m.levels = groups.whole(g);
    } else if (g.code == 92 && !in_points) {
      in_points = true;
      m.point_count = groups.whole(g);
    } else if (g.code == 93 && m.face_list_size < 0) {
      m.face_list_size = groups.whole(g);
    } else if (g.code == 94 && m.edge_count < 0) {
      m.edge_count = groups.whole(g);
    } else if (g.code == 95) {
      m.crease_count = groups.whole(g);
    } else if (g.code == 90 && m.face_list_size >= 0) {
      (m.edge_count < 0 ? m.faces : m.edges).push_back(groups.whole(g));
    } else if (in_points && m.face_list_size < 0) {
      if (g.code == 10) m.points.push_back(Vec3(groups.number(g), 0, 0));
      if (g.code == 20 && !m.points.empty()) m.points.back().y() = groups.number(g);
      if (g.code == 30 && !m.points.empty()) m.points.back().z() = groups.number(g);
    }
  }
  return m;
}

std::uint32_t checked_index(const DxfGroups& groups, const DxfEntity& entity, const MeshLists& m, std::int64_t index) {
  if (index < 0 || index >= static_cast<std::int64_t>(m.points.size())) {
    groups.fail(entity[0], "vertex " + std::to_string(index) + " in a MESH",
                "0.." + std::to_string(m.points.size()) + " (not included)");
  }
  return static_cast<std::uint32_t>(index);
}

SubdivisionCage cage_of(const DxfGroups& groups, const DxfEntity& entity, const MeshLists& m) {
  if (m.point_count != static_cast<std::int64_t>(m.points.size()) ||
      m.face_list_size != static_cast<std::int64_t>(m.faces.size())) {
    groups.fail(entity[0],
                "a MESH with " + std::to_string(m.points.size()) + " vertices and a face list of " +
                    std::to_string(m.faces.size()),
                std::to_string(m.point_count) + " (group 92) and " + std::to_string(m.face_list_size) + " (group 93)");
  }
  SubdivisionCage cage;
  cage.points = m.points;
  for (std::size_t i = 0; i < m.faces.size();) {
    const std::int64_t size = m.faces[i++];
    if (size < 0 || size > static_cast<std::int64_t>(m.faces.size() - i)) {
      groups.fail(entity[0], "a face of " + std::to_string(size) + " corners in the face list",
                  "3 or more, within the list");
    }
    std::vector<std::uint32_t> face;
    for (std::int64_t k = 0; k < size; ++k) face.push_back(checked_index(groups, entity, m, m.faces[i++]));
    if (face.size() >= 3) cage.faces.push_back(std::move(face));
  }
  for (std::size_t i = 0; i + 1 < m.edges.size() && i / 2 < m.creases.size(); i += 2) {
    const double value = m.creases[i / 2];
    if (value == 0) continue;
    cage.creases.push_back(
        {{checked_index(groups, entity, m, m.edges[i]), checked_index(groups, entity, m, m.edges[i + 1])},
         value < 0 ? std::numeric_limits<double>::infinity() : value});
  }
  return cage;
}

}  // namespace

void add_dxf_mesh(DxfGroups& groups, const DxfEntity& entity, DxfBlock& block) {
  const MeshLists lists = lists_of(groups, entity);
  SubdivisionCage cage = cage_of(groups, entity, lists);
  for (std::int64_t level = 0; level < lists.levels; ++level) {
    std::size_t faces = 0;
    for (const auto& face : cage.faces) faces += face.size();  // as many as the next level has
    if (faces == 0) break;
    if (faces > groups.smooth_faces_left) {
      ++block.too_smooth;
      break;
    }
    groups.smooth_faces_left -= faces;
    cage = subdivide(cage);
  }
  for (const auto& face : cage.faces) {
    std::vector<Vec3> corners;
    for (const std::uint32_t k : face) corners.push_back(cage.points[k]);
    block.facets.add_polygon(corners);
  }
}

}  // namespace tribin::io
