#include "tribin/eval/in_view.hpp"

#include <algorithm>
#include <cmath>

namespace tribin::eval {
namespace {

constexpr int kTellingPixels = 25;
constexpr double kTellingMm = 0.5, kInFrontMm = 2;

Image<float> rendered(const RenderMesh& mesh, const PinholeCamera& camera, const Pose& pose) {
  IndexRender render;
  render_index(mesh, camera, pose, 1, render);
  Image<float> z(camera.width, camera.height, 0);
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const float inverse = render.inverse_z[render.index(i, j)];
      const int u = render.u0 + i, v = render.v0 + j;
      if (inverse > 0 && u >= 0 && v >= 0 && u < camera.width && v < camera.height) z(u, v) = 1 / inverse;
    }
  return z;
}

/// Measured pixels at which the two differ, not hidden by anything that the scan shows in front of both.
int telling_pixels(const Scan& scan, const Image<float>& a, const Image<float>& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const float measured = scan.z_mm.data[i], za = a.data[i], zb = b.data[i];
    if (!(measured > 0) || (za == 0 && zb == 0)) continue;
    const float nearest = za == 0 ? zb : zb == 0 ? za : std::min(za, zb);
    if (measured < nearest - kInFrontMm) continue;
    count += za == 0 || zb == 0 || std::abs(za - zb) > kTellingMm;
  }
  return count;
}

}  // namespace

bool feature_in_view(const Scan& scan, const RenderMesh& mesh, std::span<const Pose> near_symmetries,
                     const Pose& camera_from_part) {
  if (near_symmetries.empty()) return true;
  const Image<float> there = rendered(mesh, scan.camera, camera_from_part);
  return std::all_of(near_symmetries.begin(), near_symmetries.end(), [&](const Pose& turn) {
    return telling_pixels(scan, there, rendered(mesh, scan.camera, camera_from_part * turn)) >= kTellingPixels;
  });
}

}  // namespace tribin::eval
