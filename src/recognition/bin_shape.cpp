#include <algorithm>
#include <cmath>
#include <limits>

#include "tribin/core/parallel.hpp"
#include "tribin/recognition/bin.hpp"

namespace tribin {
namespace {

constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();

/// Gaps are closed from their rims inwards, ring by ring, each column by the mean of its known neighbours.
void close_gaps(Image<float>& height) {
  std::vector<std::pair<std::size_t, float>> ring;
  do {
    ring.clear();
    for (int j = 0; j < height.height; ++j)
      for (int i = 0; i < height.width; ++i) {
        if (!std::isnan(height(i, j))) continue;
        float sum = 0;
        int count = 0;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di)
            if (height.contains(i + di, j + dj) && !std::isnan(height(i + di, j + dj)))
              sum += height(i + di, j + dj), ++count;
        if (count > 0)
          ring.emplace_back(static_cast<std::size_t>(j) * height.width + i, sum / static_cast<float>(count));
      }
    for (const auto& [at, value] : ring) height.data[at] = value;
  } while (!ring.empty());
}

}  // namespace

Mesh bin_mesh(const BinShape& shape) {
  Mesh mesh;
  mesh.name = "bin";
  const float x = static_cast<float>(shape.inner_size_mm.x() / 2), y = static_cast<float>(shape.inner_size_mm.y() / 2),
              w = static_cast<float>(shape.wall_mm), h = static_cast<float>(shape.inner_size_mm.z());
  // Four rings of four corners: inner floor, inner rim, outer rim, outer floor; each seen from above, against the
  // clock.
  const auto ring = [&](float a, float b, float z) {
    mesh.vertices.insert(mesh.vertices.end(), {Vec3f(-a, -b, z), Vec3f(a, -b, z), Vec3f(a, b, z), Vec3f(-a, b, z)});
  };
  ring(x, y, 0), ring(x, y, h), ring(x + w, y + w, h), ring(x + w, y + w, -w);
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  quad(0, 1, 2, 3);
  for (std::uint32_t r = 0; r < 3; ++r)
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t k = (i + 1) % 4;
      quad(4 * r + i, 4 * r + 4 + i, 4 * r + 4 + k, 4 * r + k);
    }
  quad(12, 15, 14, 13);
  return mesh;
}

Image<std::uint8_t> cells_inside(const BinSighting& bin, const Surfels& surfels) {
  const Scan& scan = *surfels.scan;
  const int cell_px = surfels.cell_px;
  const Pose bin_from_camera = bin.camera_from_bin.inverse();
  const Eigen::Vector3d half = bin.shape.inner_size_mm / 2;
  const double t = bin.tolerance_mm, rim = bin.shape.inner_size_mm.z() + t, wall = bin.shape.wall_mm;
  Image<std::uint8_t> out(surfels.surfel_of_cell.width, surfels.surfel_of_cell.height, 0);
  parallel_ranges(out.height, 16, [&](int begin, int end) {
    for (int j = begin; j < end; ++j)
      for (int i = 0; i < out.width; ++i) {
        int inside = 0, measured = 0;
        for (int v = j * cell_px; v < std::min(scan.height(), (j + 1) * cell_px); ++v)
          for (int u = i * cell_px; u < std::min(scan.width(), (i + 1) * cell_px); ++u) {
            if (!(scan.z_mm(u, v) > 0)) continue;
            ++measured;
            const Eigen::Vector3d p = bin_from_camera * Eigen::Vector3d(scan.point(u, v));
            const double reach = p.z() > rim ? wall : p.z() > t ? -t : -1e9;
            inside += std::abs(p.x()) < half.x() + reach && std::abs(p.y()) < half.y() + reach;
          }
        out(i, j) = 2 * inside > measured;
      }
  });
  return out;
}

double fill_of(const BinSighting& bin, const Scan& scan) {
  const Pose bin_from_camera = bin.camera_from_bin.inverse();
  const Vec3 size = bin.shape.inner_size_mm;
  // Columns as wide as two pixels at the floor: mostly some points fall into each.
  const double pixel = bin.camera_from_bin.translation().z() / scan.camera.fx;
  const double pitch = std::max(2 * pixel, std::max(size.x(), size.y()) / 500);
  Image<float> height(static_cast<int>(std::ceil(size.x() / pitch)), static_cast<int>(std::ceil(size.y() / pitch)), 0);
  Image<std::uint32_t> points(height.width, height.height, 0);
  const double t = bin.tolerance_mm;
  for (int v = 0; v < scan.height(); ++v)
    for (int u = 0; u < scan.width(); ++u) {
      if (!(scan.z_mm(u, v) > 0)) continue;
      const Eigen::Vector3d p = bin_from_camera * Eigen::Vector3d(scan.point(u, v));
      if (std::abs(p.x()) > size.x() / 2 - t || std::abs(p.y()) > size.y() / 2 - t) continue;  // a wall
      const int i = std::min(height.width - 1, static_cast<int>((p.x() + size.x() / 2) / pitch)),
                j = std::min(height.height - 1, static_cast<int>((p.y() + size.y() / 2) / pitch));
      // Below the floor is noise of the floor, and must count, or an empty bin would seem filled; a hole is not.
      height(i, j) += static_cast<float>(std::clamp(p.z(), -2 * t, size.z()));
      ++points(i, j);
    }
  for (std::size_t k = 0; k < height.size(); ++k)
    height.data[k] = points.data[k] > 0 ? height.data[k] / static_cast<float>(points.data[k]) : kNoHeight;
  close_gaps(height);
  double sum = 0;
  for (const float h : height.data) sum += std::isnan(h) ? 0 : h;
  return std::clamp(sum / (static_cast<double>(height.size()) * size.z()), 0.0, 1.0);
}

}  // namespace tribin
