#include "surfel/bend_bias.hpp"

#include <cmath>

#include "tribin/core/parallel.hpp"

namespace tribin::surfel_detail {
namespace {

/// 1/z where a ray meets the paraboloid of the surfel: offset q = s ray - p, q.n = -(k1 a^2 + k2 b^2) / 2. \return 0
/// where it misses.
double inverse_depth_of(const Vec3& ray, const Vec3& p, const Vec3& n, const Vec3& t1, const Vec3& t2, double k1,
                        double k2) {
  const double rn = ray.dot(n), r1 = ray.dot(t1), r2 = ray.dot(t2), pn = p.dot(n), p1 = p.dot(t1), p2 = p.dot(t2);
  // Newton from the tangent plane: within a window the paraboloid is next to it.
  double s = pn / rn;
  for (int round = 0; round < 3; ++round) {
    const double a = s * r1 - p1, b = s * r2 - p2;
    const double f = s * rn - pn + 0.5 * (k1 * a * a + k2 * b * b), slope = rn + k1 * a * r1 + k2 * b * r2;
    if (slope * rn < 0.05 * rn * rn) return 0;  // the ray grazes it
    s -= f / slope;
  }
  return s > 0 ? 1.0 / s : 0;
}

}  // namespace

std::vector<Vec3f> bend_bias(const Surfels& surfels, int window_px) {
  std::vector<Vec3f> out(surfels.size(), Vec3f::Zero());
  const PinholeCamera& camera = surfels.scan->camera;
  const int half = window_px / 2;
  parallel_ranges(static_cast<int>(surfels.size()), 256, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (std::abs(surfels.curvature1[i]) < 3 * surfels.sigma_curvature[i] || surfels.direction2[i].isZero()) continue;
      const Vec3 p = surfels.position[i].cast<double>(), n = surfels.normal[i].cast<double>();
      const Vec3 t2 = surfels.direction2[i].cast<double>(), t1 = t2.cross(n);
      const Vec3 center = p / p.z();
      double xx = 0, yy = 0, xw = 0, yw = 0, w0 = 0;
      bool whole = true;
      for (int v = -half; v <= half && whole; ++v)
        for (int u = -half; u <= half; ++u) {
          const double x = u / camera.fx, y = v / camera.fy;
          const double w =
              inverse_depth_of(center + Vec3(x, y, 0), p, n, t1, t2, surfels.curvature1[i], surfels.curvature2[i]);
          if (w == 0) whole = false;
          xx += x * x, yy += y * y, xw += x * w, yw += y * w, w0 += w;
        }
      if (!whole) continue;
      const double wx = xw / xx, wy = yw / yy, w = w0 / ((2 * half + 1) * (2 * half + 1));
      const Vec3 fitted = -Vec3(wx, wy, w - center.x() * wx - center.y() * wy).normalized();
      out[i] = (fitted - n).cast<float>();
    }
  });
  return out;
}

}  // namespace tribin::surfel_detail
