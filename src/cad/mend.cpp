#include "tribin/cad/mend.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "cad/winding.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

void check(const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!mesh.vertices[i].allFinite()) {
      throw Error(ErrorCode::bad_input,
                  "vertex " + std::to_string(i) + ": saw a coordinate that is no number, wanted finite coordinates");
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::uint32_t corner : mesh.triangles[i]) {
      if (corner >= mesh.vertices.size()) {
        throw Error(ErrorCode::bad_input, "triangle " + std::to_string(i) + ": saw vertex " + std::to_string(corner) +
                                              ", wanted one of " + std::to_string(mesh.vertices.size()));
      }
    }
  }
}

/// Keeps the triangles of which keep(i) is true.
template <class Keep>
std::size_t filter_triangles(Mesh& mesh, Keep keep) {
  std::size_t kept = 0;
  const std::size_t before = mesh.triangles.size();
  for (std::size_t i = 0; i < before; ++i) {
    if (!keep(i)) continue;
    mesh.triangles[kept] = mesh.triangles[i];
    if (!mesh.face_of_triangle.empty()) mesh.face_of_triangle[kept] = mesh.face_of_triangle[i];
    ++kept;
  }
  mesh.triangles.resize(kept);
  if (!mesh.face_of_triangle.empty()) mesh.face_of_triangle.resize(kept);
  return before - kept;
}

std::size_t drop_duplicates(Mesh& mesh) {
  std::vector<std::array<std::uint32_t, 3>> keys(mesh.triangles);
  for (auto& key : keys) std::sort(key.begin(), key.end());
  std::vector<std::uint32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; });
  std::vector<char> repeated(keys.size(), 0);
  for (std::size_t i = 1; i < order.size(); ++i) repeated[order[i]] = keys[order[i]] == keys[order[i - 1]];
  return filter_triangles(mesh, [&](std::size_t i) { return !repeated[i]; });
}

bool flat(const Mesh& mesh, const std::array<std::uint32_t, 3>& t, double tolerance) {
  const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
             c = mesh.vertices[t[2]].cast<double>();
  const double longest = std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  return (b - a).cross(c - a).norm() <= tolerance * longest;  // height over the longest side
}

void add_warnings(Mesh& mesh, const MendReport& report, std::size_t triangles) {
  const auto say = [&](std::size_t count, const std::string& text) {
    if (count) mesh.warnings.push_back(std::to_string(count) + text);
  };
  say(report.degenerate, " triangles without area were dropped");
  say(report.duplicate, " duplicate triangles were dropped");
  say(report.flipped, " of " + std::to_string(triangles) + " triangles were wound inward or mixed and were turned");
  say(report.boundary_edges, " edges belong to one triangle only: the surface is open there");
  say(report.junction_edges, " edges belong to more than two triangles");
  say(report.unoriented_shells, " of " + std::to_string(report.shells) + " shells: the outside cannot be told" +
                                    (mesh.oriented ? "" : "; the mesh is used two-sided"));
}

}  // namespace

MendReport mend_mesh(Mesh& mesh) {
  MendReport report;
  TRIBIN_ASSERT(mesh.face_of_triangle.empty() || mesh.face_of_triangle.size() == mesh.triangles.size());
  check(mesh);
  float largest = 0;
  for (const Vec3f& p : mesh.vertices) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  // 8 units in the last place of a float: what writers lose by single precision or six digits of text.
  const double tolerance = std::ldexp(static_cast<double>(largest), -20);
  const std::size_t before = mesh.triangles.size();
  report.welded = weld_vertices(mesh, tolerance);
  report.degenerate = filter_triangles(mesh, [&](std::size_t i) {
    const auto& t = mesh.triangles[i];
    return t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
  });
  report.duplicate = drop_duplicates(mesh);
  if (!mesh.triangles.empty()) mend_winding(mesh, report);
  // Slivers hold the shell together over T-junctions, so that they go only after the winding is known.
  report.degenerate += filter_triangles(mesh, [&](std::size_t i) { return !flat(mesh, mesh.triangles[i], tolerance); });
  if (mesh.triangles.empty()) {
    throw Error(ErrorCode::too_little_data, "saw " + std::to_string(before) +
                                                " triangles of which none has an area, "
                                                "wanted the surface of a part");
  }
  weld_vertices(mesh, 0);  // drops the vertices that no triangle uses
  add_warnings(mesh, report, before);
  return report;
}

}  // namespace tribin
