#include "tribin/pose/scene_depth.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/parallel.hpp"
#include "tribin/pose/edge_blur.hpp"

namespace tribin {

double correlation_inflation(double correlation_px) { return std::max(1.0, 4 * kPi * correlation_px * correlation_px); }

SceneDepth make_scene_depth(const Scan& scan, const Surfels& surfels) {
  SceneDepth out;
  out.camera = scan.camera;
  out.z_mm = scan.z_mm;
  out.surfels = &surfels;
  out.cell_normal = Image<Vec3f>(surfels.surfel_of_cell.width, surfels.surfel_of_cell.height, Vec3f(0, 0, 0));
  for (std::size_t i = 0; i < surfels.surfel_of_cell.size(); ++i)
    if (surfels.surfel_of_cell.data[i] >= 0)
      out.cell_normal.data[i] = surfels.normal[static_cast<std::size_t>(surfels.surfel_of_cell.data[i])];
  out.cell_px = surfels.cell_px;
  out.correlation_px = surfels.correlation_px;
  std::vector<float> tiles = surfels.local_sigma_mm.data;
  std::erase_if(tiles, [](float s) { return !(s > 0); });
  if (!tiles.empty()) {
    std::nth_element(tiles.begin(), tiles.begin() + tiles.size() / 2, tiles.end());
    out.median_sigma_mm = tiles[tiles.size() / 2];
  }
  out.edge_blur_px = edge_blur_px(out);
  out.mixed = mixed_pixels(out);

  // A break: a step that no surface below 80 deg of incidence makes between two pixels, and that noise does not make.
  const int w = scan.width(), h = scan.height();
  out.near_break = Image<std::uint8_t>(w, h, 0);
  const float steepest = 5.7f;  // tan 80 deg
  const float slope_x = steepest / static_cast<float>(scan.camera.fx),
              slope_y = steepest / static_cast<float>(scan.camera.fy);
  Image<std::uint8_t> edge(w, h, 0);
  parallel_ranges(h, 64, [&](int begin, int end) {
    for (int v = begin; v < end; ++v) {
      for (int u = 0; u < w; ++u) {
        const float z = out.z_mm(u, v);
        if (!(z > 0)) {
          edge(u, v) = 1;
          continue;
        }
        const float noise = 6 * out.sigma_mm(u, v);
        const auto breaks = [&](int uu, int vv, float slope) {
          if (uu >= w || vv >= h) return false;
          const float other = out.z_mm(uu, vv);
          return !(other > 0) || std::abs(other - z) > slope * z + noise;
        };
        if (breaks(u + 1, v, slope_x) || breaks(u, v + 1, slope_y)) edge(u, v) = 1;
      }
    }
  });
  parallel_ranges(h, 64, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < w; ++u) {
        std::uint8_t hit = 0;
        for (int dv = -1; dv <= 1; ++dv)
          for (int du = -1; du <= 1; ++du) {
            const int uu = u + du, vv = v + dv;
            if (uu >= 0 && vv >= 0 && uu < w && vv < h) hit |= edge(uu, vv);
          }
        out.near_break(u, v) = hit;
      }
  });
  return out;
}

}  // namespace tribin
