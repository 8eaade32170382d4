#include "tribin/pose/verification.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "inside_silhouette.hpp"
#include "outline_side.hpp"

namespace tribin {
namespace {

// Outside of the outline the scan is looked at two rendered pixels away, beside the mixed pixels of the edge; the
// surface may still go on three farther, across the pits of one that is measured here and there. Where the sensor draws
// its edges wider, all of it lies so much farther out.
constexpr int kOutside = 2, kFarthest = 5;

/// What the scan shows at a rendered pixel.
enum class Seen { supported, misfit, violated, occluded, no_data };

struct Look {
  Seen seen = Seen::no_data;
  OutlineFacet facet;
  double sigma_mm = 0;  ///< of the residual
  double in_sigma = 0;  ///< the residual [sigma]
  double in_limit = 0;  ///< the residual over what is still supported
};

/// What is still the surface. Mirrored light throws single pixels up to five sigma off; a sensor that draws steps out
/// takes each depth from many pixels, and what is off by more than four sigma well inside an outline is something else.
double supported_sigmas(const SceneDepth& scene) { return scene.edge_blur_px > 0 ? 4 : 5; }

Look look_at(const SceneDepth& scene, const IndexRender& render, const VerificationOptions& options, int i, int j) {
  const double near_mm = 0.03 * options.diameter_mm;  // nearer than this an occluder would touch: it is a misfit
  const std::size_t k = render.index(i, j);
  const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
  const Vec3f& n = render.normal[static_cast<std::size_t>(render.triangle[k])];
  const double along = n.cast<double>().dot(scene.camera.ray(u, v));
  const double z_model = 1.0 / render.inverse_z[k];
  const double slant = std::max(std::abs(along), 0.2);  // beyond 78 deg the depth decides, not the distance
  Look out;
  out.facet = {n.cast<double>(), along * z_model, z_model};
  out.sigma_mm = std::hypot(scene.sigma_mm(u, v) * slant, options.cad_sigma_mm);
  const float z = scene.z_mm(u, v);
  if (!(z > 0)) return out;
  const double r = (z - z_model) * slant;
  const double tau = std::max(supported_sigmas(scene) * out.sigma_mm, options.tolerance_mm);
  out.in_sigma = r / out.sigma_mm;
  out.in_limit = r / tau;
  if (std::abs(r) <= tau)
    out.seen = Seen::supported;
  else if (r < -tau - near_mm)
    out.seen = scene.is_floor(u, v) ? Seen::violated : Seen::occluded;
  else
    out.seen = r > tau + near_mm ? Seen::violated : Seen::misfit;
  return out;
}

/// Beside the outline: does the scene end there too?
/// \param rim  how far on both sides of the outline the sensor mixes what it sees [rendered pixels]
void ask_outline(const SceneDepth& scene, const IndexRender& render, const VerificationOptions& options, int rim, int i,
                 int j, const Look& look, Verification& out) {
  // A shade is as wide as what throws it is high: up to half of what is rendered is looked across.
  const int across = std::max(kFarthest + rim, std::max(render.width, render.height) / 2);
  const double pitch_mm = look.facet.z * (options.step_px / scene.camera.fx);
  const auto part_at = [&](int ii, int jj) {
    return ii >= 0 && jj >= 0 && ii < render.width && jj < render.height && render.triangle[render.index(ii, jj)] >= 0;
  };
  constexpr std::array<std::array<int, 2>, 4> kSides = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  for (const auto& d : kSides) {
    if (part_at(i + d[0], j + d[1])) continue;
    // The part is there where a supported pixel says so: this one, or the first beyond what is mixed.
    const int ii = i - rim * d[0], jj = j - rim * d[1];
    const bool there = rim == 0 ? look.seen == Seen::supported
                                : part_at(ii, jj) && look_at(scene, render, options, ii, jj).seen == Seen::supported;
    if (!there) continue;
    const Beside beside = look_beside(scene, render.u0 + i * render.step, render.v0 + j * render.step,
                                      d[0] * render.step, d[1] * render.step, kOutside + rim, kFarthest + rim, across,
                                      look.facet, std::max(6 * look.sigma_mm, pitch_mm));
    out.outline += beside != Beside::hidden;
    out.outline_breaks += beside == Beside::ends;
  }
}

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
  const int rim = scene.rim(options.step_px);
  // Without outliers the last that is supported is worth as little as a misfit.
  const double off_costs = rim > 0 ? 2 : 0.5;
  double gain = 0, squares = 0;
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      if (render.triangle[render.index(i, j)] < 0) continue;
      const Look look = look_at(scene, render, options, i, j);
      if (rim > 0 || look.seen == Seen::supported) ask_outline(scene, render, options, rim, i, j, look, out);
      // What the sensor mixes speaks neither for nor against the pose.
      if (rim > 0 && !inside_silhouette(render, i, j, rim)) continue;
      ++out.pixels;
      switch (look.seen) {
        case Seen::supported:
          ++out.supported;
          gain += 1 - off_costs * look.in_limit * look.in_limit;
          squares += look.in_sigma * look.in_sigma;
          break;
        case Seen::misfit:
          ++out.misfit;
          gain -= 1;
          break;
        case Seen::violated:
          ++out.violated;
          gain -= 3;
          break;
        case Seen::occluded:
          ++out.occluded;
          break;
        case Seen::no_data:
          ++out.no_data;
          gain -= 0.05;
          break;
      }
    }
  out.gain = gain * options.step_px * options.step_px;
  out.rms_sigma = out.supported ? std::sqrt(squares / out.supported) : 0;
  return out;
}

}  // namespace tribin
