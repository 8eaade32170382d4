#include <algorithm>
#include <cmath>
#include <optional>

#include "io/dxf.hpp"

namespace tribin::io {
namespace {

/// The first group of a code, or nothing.
const DxfGroup* find(const DxfEntity& entity, int code) {
  for (const DxfGroup& g : entity) {
    if (g.code == code) return &g;
  }
  return nullptr;
}

double number_or(const DxfGroups& groups, const DxfEntity& entity, int code, double otherwise) {
  const DxfGroup* g = find(entity, code);
  return g ? groups.number(*g) : otherwise;
}

std::int64_t whole_or(const DxfGroups& groups, const DxfEntity& entity, int code, std::int64_t otherwise) {
  const DxfGroup* g = find(entity, code);
  return g ? groups.whole(*g) : otherwise;
}

/// A point by its codes x, x + 10, x + 20; DXF may leave out the z of 0.
std::optional<Vec3> point_of(const DxfGroups& groups, const DxfEntity& entity, int x) {
  if (!find(entity, x)) return {};
  return Vec3(number_or(groups, entity, x, 0), number_or(groups, entity, x + 10, 0),
              number_or(groups, entity, x + 20, 0));
}

/// The rotation into the world of the frame that belongs to an extrusion direction ("arbitrary axis algorithm").
Matrix3 world_from_object(Vec3 z) {
  if (z.norm() < 1e-12) z = Vec3::UnitZ();
  z.normalize();
  const bool near_z = std::abs(z.x()) < 1.0 / 64 && std::abs(z.y()) < 1.0 / 64;
  const Vec3 x = Vec3((near_z ? Vec3::UnitY() : Vec3::UnitZ()).cross(z)).normalized();
  Matrix3 rotation;
  rotation.col(0) = x;
  rotation.col(1) = Vec3(z.cross(x));
  rotation.col(2) = z;
  return rotation;
}

void add_face(const DxfGroups& groups, const DxfEntity& entity, DxfBlock& block) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 4; ++i) {
    const auto p = point_of(groups, entity, 10 + i);
    if (!p && i == 3) break;  // a triangle
    if (!p) groups.fail(entity[0], "a 3DFACE without corner " + std::to_string(i + 1), "groups 10 to 12, or 13");
    if (i == 0 || *p != corners.back()) corners.push_back(*p);
  }
  if (corners.size() >= 3) block.facets.add_polygon(corners);
}

/// The vertices and face records that follow a POLYLINE, up to SEQEND.
struct DxfVertex {
  Vec3 point = Vec3::Zero();
  std::int64_t flags = 0;
  std::array<std::int64_t, 4> corner{0, 0, 0, 0};
  DxfGroup at;
};

DxfVertex vertex_of(const DxfGroups& groups, const DxfEntity& entity) {
  DxfVertex v;
  v.point = point_of(groups, entity, 10).value_or(Vec3::Zero());
  v.flags = whole_or(groups, entity, 70, 0);
  for (int i = 0; i < 4; ++i) v.corner[i] = whole_or(groups, entity, 71 + i, 0);
  v.at = entity[0];
  return v;
}

void add_polyface(const DxfGroups& groups, const std::vector<DxfVertex>& vertices, DxfBlock& block) {
  std::vector<Vec3> points;
  for (const DxfVertex& v : vertices) {
    if (v.flags & 64) points.push_back(v.point);
  }
  for (const DxfVertex& v : vertices) {
    if ((v.flags & 64) || !(v.flags & 128)) continue;
    std::vector<Vec3> corners;
    for (std::int64_t index : v.corner) {
      if (index == 0) break;  // a triangle
      if (std::abs(index) >
          static_cast<std::int64_t>(points.size())) {  // the sign says only that the edge is not drawn
        groups.fail(v.at, "vertex " + std::to_string(index), "1.." + std::to_string(points.size()));
      }
      corners.push_back(points[static_cast<std::size_t>(std::abs(index) - 1)]);
    }
    if (corners.size() >= 3) block.facets.add_polygon(corners);
  }
}

void add_polymesh(const DxfGroups& groups, const DxfEntity& polyline, const std::vector<DxfVertex>& vertices,
                  DxfBlock& block) {
  const std::int64_t flags = whole_or(groups, polyline, 70, 0);
  std::int64_t m = whole_or(groups, polyline, 71, 0), n = whole_or(groups, polyline, 72, 0);
  // A smooth surface comes with its points in the file (flag 8), beside the control points (flag 16).
  const bool smooth = std::any_of(vertices.begin(), vertices.end(), [](const DxfVertex& v) { return v.flags & 8; });
  if (smooth) m = whole_or(groups, polyline, 73, m), n = whole_or(groups, polyline, 74, n);
  std::vector<Vec3> grid;
  for (const DxfVertex& v : vertices) {
    if (!smooth || !(v.flags & 16)) grid.push_back(v.point);
  }
  if (m < 2 || n < 2 || m > 65535 || n > 65535 || m * n != static_cast<std::int64_t>(grid.size())) {
    groups.fail(polyline[0],
                "a mesh of " + std::to_string(m) + " x " + std::to_string(n) + " with " + std::to_string(grid.size()) +
                    " vertices",
                "m x n of them, m and n >= 2");
  }
  const auto first = static_cast<std::uint32_t>(block.facets.vertices.size());
  block.facets.vertices.insert(block.facets.vertices.end(), grid.begin(), grid.end());
  const std::int64_t rows = (flags & 1) ? m : m - 1, columns = (flags & 32) ? n : n - 1;
  const auto at = [&](std::int64_t i, std::int64_t j) {
    return first + static_cast<std::uint32_t>((i % m) * n + j % n);
  };
  for (std::int64_t i = 0; i < rows; ++i) {
    for (std::int64_t j = 0; j < columns; ++j) {
      block.facets.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      block.facets.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
}

std::size_t count_of(const DxfGroups& groups, const DxfEntity& entity, int code) {
  const std::int64_t count = whole_or(groups, entity, code, 1);
  if (count < 0 || count > 32767)
    groups.fail(entity[0], std::to_string(count) + " rows or columns of an INSERT", "1..32767");
  return count == 0 ? 1 : static_cast<std::size_t>(count);
}

void add_insert(const DxfGroups& groups, const DxfEntity& entity, DxfBlock& block) {
  const DxfGroup* name = find(entity, 2);
  if (!name) groups.fail(entity[0], "an INSERT without the name of a block", "group 2");
  DxfInsert insert;
  insert.block = name->value;
  insert.columns = count_of(groups, entity, 70);
  insert.rows = count_of(groups, entity, 71);
  const Matrix3 object = world_from_object(point_of(groups, entity, 210).value_or(Vec3::UnitZ()));
  const Eigen::Matrix3d turned =
      Eigen::Matrix3d(object) *
      Eigen::AngleAxisd(number_or(groups, entity, 50, 0) * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  // The place is in the object's frame and is not scaled; nor are the steps between rows and columns.
  insert.place.translation() = object * point_of(groups, entity, 10).value_or(Vec3::Zero());
  insert.place.linear() = turned * Eigen::Vector3d(number_or(groups, entity, 41, 1), number_or(groups, entity, 42, 1),
                                                   number_or(groups, entity, 43, 1))
                                       .asDiagonal();
  insert.column_step = turned.col(0) * number_or(groups, entity, 44, 0);
  insert.row_step = turned.col(1) * number_or(groups, entity, 45, 0);
  block.inserts.push_back(std::move(insert));
}

}  // namespace

DxfBlock read_dxf_entities(DxfGroups& groups, std::string_view end) {
  DxfBlock block;
  DxfEntity entity, polyline;
  std::vector<DxfVertex> vertices;
  DxfGroup next = groups.next();
  while (next.code != 0) next = groups.next();  // what stands before the first entity is the block's own
  while (next.value != end) {
    if (next.value == "EOF" || next.value == "ENDSEC") groups.fail(next, in_quotes(next.value), end);
    entity.assign(1, next);
    for (next = groups.next(); next.code != 0; next = groups.next()) entity.push_back(next);
    const std::string_view type = entity[0].value;
    if (whole_or(groups, entity, 67, 0) == 1) continue;  // paper space
    if (type == "3DFACE") {
      add_face(groups, entity, block);
    } else if (type == "MESH") {
      add_dxf_mesh(groups, entity, block);
    } else if (type == "INSERT") {
      add_insert(groups, entity, block);
    } else if (type == "POLYLINE") {
      polyline = entity;
      vertices.clear();
    } else if (type == "VERTEX") {
      if (!polyline.empty()) vertices.push_back(vertex_of(groups, entity));
    } else if (type == "SEQEND") {
      const std::int64_t flags = polyline.empty() ? 0 : whole_or(groups, polyline, 70, 0);
      if (flags & 64) {
        add_polyface(groups, vertices, block);
      } else if (flags & 16) {
        add_polymesh(groups, polyline, vertices, block);
      } else if (!polyline.empty()) {
        ++block.ignored["POLYLINE"];
      }
      polyline.clear();
    } else if (type != "ATTRIB" && type != "ATTDEF") {
      ++block.ignored[std::string(type)];
    }
  }
  return block;
}

}  // namespace tribin::io
