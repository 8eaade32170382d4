#include "tribin/pose/verification.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "outline_side.hpp"

namespace tribin {
namespace {

// Outside of the outline the scan is looked at two rendered pixels away, beside the mixed pixels of the edge; the
// surface may still go on three farther, across the pits of one that is measured here and there.
constexpr int kOutside = 2, kFarthest = 5;

}  // namespace

double Verification::fit() const {
  const int n = judged();
  return n > 0 ? gain / (double(n) * step_px * step_px) : -1;
}

Verification verify_pose(const RenderMesh& mesh, const SceneDepth& scene, const Pose& camera_from_part,
                         const VerificationOptions& options) {
  thread_local IndexRender render;
  render_index(mesh, scene.camera, camera_from_part, options.step_px, render);
  Verification out;
  out.step_px = options.step_px;
  const PinholeCamera& camera = scene.camera;
  const double near_mm = 0.03 * options.diameter_mm;  // nearer than this an occluder would touch: it is a misfit
  const double pitch_factor = options.step_px / camera.fx;
  // A shade is as wide as what throws it is high: up to half of what is rendered is looked across.
  const int across = std::max(kFarthest, std::max(render.width, render.height) / 2);
  double gain = 0, squares = 0;
  for (int j = 0; j < render.height; ++j) {
    const int v = render.v0 + j * render.step;
    for (int i = 0; i < render.width; ++i) {
      const std::size_t k = render.index(i, j);
      const std::int32_t triangle = render.triangle[k];
      if (triangle < 0) continue;
      ++out.pixels;
      const int u = render.u0 + i * render.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0)) {
        ++out.no_data;
        gain -= 0.05;
        continue;
      }
      const Vec3f& n = render.normal[static_cast<std::size_t>(triangle)];
      const Vec3 ray = camera.ray(u, v);
      const double along = n.cast<double>().dot(ray);
      const double z_model = 1.0 / render.inverse_z[k];
      const double slant = std::max(std::abs(along), 0.2);  // beyond 78 deg the depth decides, not the distance
      const double r = (z - z_model) * slant;
      const double sigma = std::hypot(scene.sigma_mm(u, v) * slant, options.cad_sigma_mm);
      const double tau = std::max(5 * sigma, options.tolerance_mm);
      if (std::abs(r) <= tau) {
        ++out.supported;
        gain += 1 - 0.5 * (r / tau) * (r / tau);
        squares += (r / sigma) * (r / sigma);
      } else if (r < -tau - near_mm) {
        ++out.occluded;
        continue;
      } else if (r > tau + near_mm) {
        ++out.violated;
        gain -= 3;
        continue;
      } else {
        ++out.misfit;
        gain -= 1;
        continue;
      }
      // A supported pixel beside the outline: does the scene end there too?
      const double plane_tolerance = std::max(6 * sigma, z_model * pitch_factor);
      const OutlineFacet facet{n.cast<double>(), along * z_model, z_model};
      constexpr std::array<std::array<int, 2>, 4> kSides = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
      for (const auto& d : kSides) {
        const int ii = i + d[0], jj = j + d[1];
        const bool outside =
            ii < 0 || jj < 0 || ii >= render.width || jj >= render.height || render.triangle[render.index(ii, jj)] < 0;
        if (!outside) continue;
        const Beside beside = look_beside(scene, u, v, d[0] * render.step, d[1] * render.step, kOutside, kFarthest,
                                          across, facet, plane_tolerance);
        out.outline += beside != Beside::hidden;
        out.outline_breaks += beside == Beside::ends;
      }
    }
  }
  out.gain = gain * options.step_px * options.step_px;
  out.rms_sigma = out.supported ? std::sqrt(squares / out.supported) : 0;
  return out;
}

}  // namespace tribin
