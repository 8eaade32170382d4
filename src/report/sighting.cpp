#include "report/sighting.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace tribin::report {
namespace {

/// Pixel at the middle of a surfel's cell.
std::pair<int, int> pixel_of(const Surfels& surfels, std::size_t i) {
  const int cells = surfels.surfel_of_cell.width, cell = static_cast<int>(surfels.cell[i]);
  return {(cell % cells) * surfels.cell_px + surfels.cell_px / 2,
          (cell / cells) * surfels.cell_px + surfels.cell_px / 2};
}

void add_primitives(Sighting& out, const Surfels& surfels, const Primitives& primitives) {
  std::vector<char> here(surfels.size(), 0);
  for (std::uint32_t i : out.surfels) here[i] = 1;
  for (std::size_t k = 0; k < primitives.items.size(); ++k) {
    const Primitive& p = primitives.items[k];
    const auto inside =
        std::count_if(p.surfels.begin(), p.surfels.end(), [&](std::uint32_t i) { return here[i] != 0; });
    if (2 * inside > static_cast<std::ptrdiff_t>(p.surfels.size())) out.primitives.push_back(static_cast<int>(k));
  }
  std::stable_sort(out.primitives.begin(), out.primitives.end(),
                   [&](int a, int b) { return primitives.items[a].area_mm2 > primitives.items[b].area_mm2; });
}

}  // namespace

Sighting sighting_of(const Scan& scan, const Surfels& surfels, const Primitives& primitives, const Part& part,
                     const Pose& camera_from_part) {
  PinholeCamera camera = scan.camera;
  camera.width = scan.width();
  camera.height = scan.height();
  const Image<float> depth = depth_of(part.mesh.vertices, part.mesh.triangles, camera_from_part, camera);
  const double reach = 0.01 * part.diameter_mm;  // wider than noise and chord, narrower than the gap to a neighbour
  Sighting out;
  out.on_part = Image<std::uint8_t>(camera.width, camera.height, 0);
  int u0 = camera.width, v0 = camera.height, u1 = 0, v1 = 0;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      if (!std::isfinite(depth(u, v))) continue;
      u0 = std::min(u0, u), u1 = std::max(u1, u + 1), v0 = std::min(v0, v), v1 = std::max(v1, v + 1);
      if (std::abs(scan.z_mm(u, v) - depth(u, v)) < reach) out.on_part(u, v) = 1;
    }
  const int margin = std::max(4, (u1 - u0) / 8);
  out.u0 = std::max(0, u0 - margin), out.v0 = std::max(0, v0 - margin);
  out.u1 = std::min(camera.width, u1 + margin), out.v1 = std::min(camera.height, v1 + margin);
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    const auto [u, v] = pixel_of(surfels, i);
    if (out.on_part.contains(u, v) && out.on_part(u, v)) out.surfels.push_back(static_cast<std::uint32_t>(i));
  }
  add_primitives(out, surfels, primitives);
  return out;
}

Sighting whole_scan(const Scan& scan, const Surfels& surfels, const Primitives& primitives) {
  Sighting out;
  out.u1 = scan.width();
  out.v1 = scan.height();
  for (std::size_t i = 0; i < surfels.size(); ++i) out.surfels.push_back(static_cast<std::uint32_t>(i));
  add_primitives(out, surfels, primitives);
  return out;
}

namespace {

/// The points of every `stride`-th pixel: the mean over its block where the block has no depth edge.
struct Grid {
  int width = 0, height = 0;
  std::vector<Vec3f> points;  ///< NaN = none
};

Grid grid_of(const Scan& scan, const Sighting& where, int stride) {
  Grid grid;
  grid.width = (where.u1 - where.u0 + stride - 1) / stride;
  grid.height = (where.v1 - where.v0 + stride - 1) / stride;
  const float none = std::numeric_limits<float>::quiet_NaN();
  grid.points.assign(static_cast<std::size_t>(grid.width) * grid.height, Vec3f(none, none, none));
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const int u = where.u0 + i * stride, v = where.v0 + j * stride;
      const float z = scan.z_mm(u, v);
      if (!std::isfinite(z)) continue;
      const double gate = 2.0 * stride * z / scan.camera.fx;  // a slope of 63 degrees
      double sum = 0;
      int count = 0;
      for (int dv = -stride / 2; dv <= stride / 2; ++dv)
        for (int du = -stride / 2; du <= stride / 2; ++du)
          if (scan.z_mm.contains(u + du, v + dv) && std::abs(scan.z_mm(u + du, v + dv) - z) < gate) {
            sum += scan.z_mm(u + du, v + dv);
            ++count;
          }
      grid.points[static_cast<std::size_t>(j) * grid.width + i] =
          (scan.point(u, v) * (count ? sum / count / z : 1.0)).cast<float>();
    }
  return grid;
}

/// The surfel's normal at a pixel, else the grid's own slope.
Vec3f normal_at(const Grid& grid, const Surfels& surfels, int u, int v, int i, int j) {
  if (surfels.cell_px > 0) {
    const int cu = u / surfels.cell_px, cv = v / surfels.cell_px;
    if (surfels.surfel_of_cell.contains(cu, cv) && surfels.surfel_of_cell(cu, cv) >= 0)
      return surfels.normal[surfels.surfel_of_cell(cu, cv)];
  }
  const auto at = [&](int a, int b) {
    return grid.points[static_cast<std::size_t>(std::clamp(b, 0, grid.height - 1)) * grid.width +
                       std::clamp(a, 0, grid.width - 1)];
  };
  const Vec3f here = at(i, j);
  Vec3f du = at(i + 1, j) - at(i - 1, j), dv = at(i, j + 1) - at(i, j - 1);
  if (!du.allFinite() || !dv.allFinite()) return -here.normalized();
  const Vec3f n = du.cross(dv);
  return n.squaredNorm() > 0 ? Vec3f(n.normalized()) : Vec3f(-here.normalized());
}

}  // namespace

ShadedSurface surface_of(const Scan& scan, const Surfels& surfels, const Sighting& where, int stride,
                         const std::function<PixelLook(int u, int v)>& look) {
  const Grid grid = grid_of(scan, where, stride);
  ShadedSurface out;
  std::vector<std::int64_t> vertex(grid.points.size(), -1);
  std::vector<PixelLook> looks(grid.points.size());
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * grid.width + i;
      if (!grid.points[k].allFinite()) continue;
      const int u = where.u0 + i * stride, v = where.v0 + j * stride;
      looks[k] = look(u, v);
      if (looks[k].material == Material::halo) continue;
      vertex[k] = static_cast<std::int64_t>(out.vertices.size());
      out.vertices.push_back(grid.points[k]);
      out.normals.push_back(normal_at(grid, surfels, u, v, i, j));
    }
  const auto near = [&](std::size_t a, std::size_t b) {
    const float za = grid.points[a].z(), zb = grid.points[b].z();
    return std::abs(za - zb) < 4.0 * stride * za / scan.camera.fx;  // steeper than 76 degrees is an edge
  };
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    if (vertex[a] < 0 || vertex[b] < 0 || vertex[c] < 0 || !near(a, b) || !near(b, c) || !near(a, c)) return;
    out.triangles.push_back({static_cast<std::uint32_t>(vertex[a]), static_cast<std::uint32_t>(vertex[b]),
                             static_cast<std::uint32_t>(vertex[c])});
    out.materials.push_back(looks[a].material);
    out.steps.push_back(looks[a].step);
    out.tints.push_back(looks[a].tint);
    out.ids.push_back(looks[a].id);
  };
  for (int j = 0; j + 1 < grid.height; ++j)
    for (int i = 0; i + 1 < grid.width; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * grid.width + i;
      add(k, k + grid.width, k + 1);
      add(k + 1, k + grid.width, k + grid.width + 1);
    }
  return out;
}

}  // namespace tribin::report
