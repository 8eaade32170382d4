#include "render_scores.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/parallel.hpp"
#include "tribin/pose/index_render.hpp"

namespace tribin {
namespace {

constexpr float kUnexplained = 0.5f * 16;  // 4 sigma: what a pixel costs that no surface explains

/// The sum over covered, measured pixels of what `worth` makes of (half the squared residual in sigma, the residual in
/// mm along the normal, > 0 behind the surface).
template <typename Worth>
double sum_of(const SceneDepth& scene, const IndexRender& render, double chord_error_mm, const Worth& worth) {
  const PinholeCamera& camera = scene.camera;
  const Image<float>& tiles = scene.surfels->local_sigma_mm;
  const int tile_px = 8 * scene.cell_px;
  const auto cad_variance = static_cast<float>(chord_error_mm * chord_error_mm);
  double sum = 0;
  for (int j = 0; j < render.height; ++j) {
    const int v = render.v0 + j * render.step;
    const float ray_y = static_cast<float>((v - camera.cy) / camera.fy);
    const int tile_row = std::min(v / tile_px, tiles.height - 1);
    int tile = -1, tile_end = 0;  // columns of the tile
    float sigma = 0, row = 0;
    for (int i = 0; i < render.width; ++i) {
      const std::size_t k = render.index(i, j);
      if (render.triangle[k] < 0) continue;
      const int u = render.u0 + i * render.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0)) continue;
      if (u >= tile_end) {
        tile = std::min(u / tile_px, tiles.width - 1);
        tile_end = tile == tiles.width - 1 ? scene.z_mm.width : (tile + 1) * tile_px;
        sigma = tiles(tile, tile_row);
      }
      const Vec3f& n = render.normal[static_cast<std::size_t>(render.triangle[k])];
      const float ray_x = static_cast<float>((u - camera.cx) / camera.fx);
      const float slant = std::max(0.2f, std::abs(n[0] * ray_x + n[1] * ray_y + n[2]));
      const float error = (z - 1 / render.inverse_z[k]) * slant;
      const float variance = sigma * slant * sigma * slant + cad_variance;
      row += worth(0.5f * error * error / variance, error);
    }
    sum += row;
  }
  return sum;
}

template <typename Worth>
std::vector<double> sums_of(const SceneDepth& scene, const Part& part, Detail detail, std::span<const Pose> poses,
                            int step_px, const Worth& worth) {
  std::vector<double> out(poses.size());
  parallel_each(static_cast<int>(poses.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    thread_local IndexRender render;
    render_index(mesh_of(part, detail), scene.camera, poses[k], step_px, render);
    out[k] = sum_of(scene, render, cad_sigma_mm(part, detail), worth);
  });
  // Pixels closer than the noise's correlation tell the same story.
  const double inflation = std::max(1.0, correlation_inflation(scene.correlation_px) / (double(step_px) * step_px));
  for (double& sum : out) sum /= inflation;
  return out;
}

}  // namespace

std::vector<double> render_scores(const SceneDepth& scene, const Part& part, Detail detail, std::span<const Pose> poses,
                                  int step_px) {
  return sums_of(scene, part, detail, poses, step_px,
                 [](float half_square, float) { return kUnexplained - std::min(kUnexplained, half_square); });
}

std::vector<double> contradictions(const SceneDepth& scene, const Part& part, Detail detail,
                                   std::span<const Pose> poses, int step_px) {
  const auto near = static_cast<float>(0.03 * part.diameter_mm);
  constexpr float kNoise = 0.5f * 9;  // 3 sigma
  return sums_of(scene, part, detail, poses, step_px, [near](float half_square, float error) {
    return half_square < kNoise || error < -near ? 0 : std::min(kUnexplained, half_square);
  });
}

}  // namespace tribin
