#pragma once

#include <cmath>

#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// What the scene shows beside an outline of the part.
enum class Beside {
  goes_on,  ///< the surface itself: it does not end here
  ends,     ///< something farther away, or nothing at all: the surface ends
  hidden    ///< something nearer: whether the surface ends here is not seen
};

/// A facet at the outline, camera frame.
struct OutlineFacet {
  Eigen::Vector3d normal;  ///< unit, towards the camera
  double rho;              ///< normal . x = rho
  double z;                ///< depth of the outline [mm]
};

/// What one measured pixel beside the outline says.
inline Beside beside_pixel(const SceneDepth& scene, int u, int v, float z_out, const OutlineFacet& facet,
                           double tolerance_mm) {
  const Eigen::Vector3d ray = scene.camera.ray(u, v);
  const double along = facet.normal.dot(ray);
  // Seen so flat (84 deg), or from behind, the facet's plane is no longer where the surface would go on.
  if (along > -0.1) return z_out > facet.z ? Beside::ends : Beside::hidden;
  const double r = along * z_out - facet.rho;  // > 0: in front of the plane
  if (std::abs(r) <= tolerance_mm) return Beside::goes_on;
  // A steep plane falls off faster than a step that is drawn out: behind the outline something ends all the same.
  if (scene.edge_blur_px > 0 && r > 0 && z_out - facet.z > tolerance_mm) return Beside::ends;
  return r < 0 ? Beside::ends : Beside::hidden;
}

/// Looks outwards from pixel (u, v) in steps of (du, dv), `first` to `last` of them. The surface goes on where it is
/// still there after `near` steps: sensors that smooth their depth draw it out beyond its edge by some pixels. Across a
/// gap of the measurement it proves nothing any more, but what is seen there tells whose edge the gap lies at: the
/// part's own, or that of something in front which shades it.
template <typename Step>
Beside look_beside(const SceneDepth& scene, double u, double v, Step du, Step dv, int first, int near, int last,
                   const OutlineFacet& facet, double tolerance_mm) {
  bool on = false;  // the surface was seen beside
  for (int far = first; far <= last && !(on && far > near); ++far) {
    const int x = static_cast<int>(std::floor(u + far * du + 0.5)),
              y = static_cast<int>(std::floor(v + far * dv + 0.5));
    if (!scene.z_mm.contains(x, y)) {  // the image's border is no edge
      if (far <= near && !on) return Beside::hidden;
      break;
    }
    const float z_out = scene.z_mm(x, y);
    if (!(z_out > 0)) continue;
    const Beside seen = beside_pixel(scene, x, y, z_out, facet, tolerance_mm);
    if (seen != Beside::goes_on) return seen;
    if (far > near) return Beside::hidden;
    on = true;
  }
  return on ? Beside::goes_on : Beside::ends;  // nothing measured there: a surface like the part's own would be
}

}  // namespace tribin
