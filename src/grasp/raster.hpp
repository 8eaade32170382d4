#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh_tree.hpp"

// Least and largest depth of a part's surface over the cells of a grid.
namespace tribin::grasp {

/// A window of a grid, cells x fastest.
struct SpanGrid {
  int u0 = 0, v0 = 0, width = 0, height = 0;
  std::vector<double> low, high;  ///< high < low where the part does not lie

  bool contains(int u, int v) const { return u >= u0 && v >= v0 && u < u0 + width && v < v0 + height; }
  std::size_t index(int u, int v) const { return static_cast<std::size_t>(v - v0) * width + (u - u0); }
  bool covers(int u, int v) const { return contains(u, v) && high[index(u, v)] >= low[index(u, v)]; }
};

/// \param project  part point -> (u, v, w): cells, whose centres are whole numbers, and a depth that is linear over a
///                 flat triangle there.
template <class Project>
SpanGrid raster_spans(const MeshTree& tree, const Project& project) {
  std::vector<std::array<Vec3, 3>> seen(tree.count());
  Vec3 low = Vec3::Constant(1e9), high = Vec3::Constant(-1e9);
  for (std::uint32_t t = 0; t < tree.count(); ++t)
    for (int k = 0; k < 3; ++k) {
      seen[t][k] = project(tree.corners(t)[k]);
      low = low.cwiseMin(seen[t][k]);
      high = high.cwiseMax(seen[t][k]);
    }
  SpanGrid grid;
  grid.u0 = static_cast<int>(std::floor(low.x()));
  grid.v0 = static_cast<int>(std::floor(low.y()));
  grid.width = static_cast<int>(std::ceil(high.x())) - grid.u0 + 1;
  grid.height = static_cast<int>(std::ceil(high.y())) - grid.v0 + 1;
  grid.low.assign(static_cast<std::size_t>(grid.width) * grid.height, 1e300);
  grid.high.assign(grid.low.size(), -1e300);
  const auto note = [&grid](int u, int v, double w) {
    const std::size_t i = grid.index(u, v);
    grid.low[i] = std::min(grid.low[i], w);
    grid.high[i] = std::max(grid.high[i], w);
  };
  for (const auto& c : seen) {
    // Corners count for the cells that they lie in: thin parts miss no cell.
    for (const Vec3& p : c) note(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())), p.z());
    const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0];
    const double area = e1.x() * e2.y() - e1.y() * e2.x();
    if (std::abs(area) < 1e-12) continue;
    const double least_v = std::min({c[0].y(), c[1].y(), c[2].y()}), most_v = std::max({c[0].y(), c[1].y(), c[2].y()});
    const double least_u = std::min({c[0].x(), c[1].x(), c[2].x()}), most_u = std::max({c[0].x(), c[1].x(), c[2].x()});
    for (int v = static_cast<int>(std::ceil(least_v)); v <= most_v; ++v)
      for (int u = static_cast<int>(std::ceil(least_u)); u <= most_u; ++u) {
        const double du = u - c[0].x(), dv = v - c[0].y();
        const double a = (du * e2.y() - dv * e2.x()) / area, b = (e1.x() * dv - e1.y() * du) / area;
        if (a < -1e-9 || b < -1e-9 || a + b > 1 + 1e-9) continue;
        note(u, v, c[0].z() + a * e1.z() + b * e2.z());
      }
  }
  return grid;
}

}  // namespace tribin::grasp
