#include "tribin/surfel/pixel_normals.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "surfel/bend_bias.hpp"
#include "surfel/tangent_mask.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {
namespace {

using namespace surfel_detail;

constexpr double kBendShare = 1.0 / 54;  // rms that a radius of two windows leaves in a window, in windows
constexpr double kLeastShare = 0.6;      // of a window that must hold depths, as of a cell

/// A plane in d = (1/z - 1/z_ref) z_ref^2 over a window.
struct PlaneFit {
  double slope_u = 0, slope_v = 0;  ///< of d per px
  double at_pixel = 0;              ///< d of the plane at the pixel
  double residual = 1e300;          ///< sd of one pixel about it
  bool valid = false;
};

/// The scan in inverse depth, about a reference that keeps its digits.
struct InverseDepth {
  const Scan& scan;
  double z_ref = 1;
  Image<float> d;

  double depth(double value) const { return 1.0 / (1.0 / z_ref + value / (z_ref * z_ref)); }
  Vec3 ray(int u, int v) const {
    return scan.rays.empty() ? Vec3(scan.camera.ray(u, v)) : Vec3(scan.rays(u, v).cast<double>());
  }
  Vec3 normal(int u, int v, const PlaneFit& plane) const {
    const double z2 = z_ref * z_ref;
    const double wx = plane.slope_u * scan.camera.fx / z2, wy = plane.slope_v * scan.camera.fy / z2;
    const Vec3 at = ray(u, v);
    return -Vec3(wx, wy, 1.0 / depth(plane.at_pixel) - at.x() * wx - at.y() * wy).normalized();
  }
};

InverseDepth inverse_depth(const Scan& scan) {
  InverseDepth out{scan, 1, Image<float>(scan.width(), scan.height(), 0.0f)};
  double sum = 0;
  std::size_t count = 0;
  for (float z : scan.z_mm.data)
    if (std::isfinite(z)) sum += 1.0 / z, ++count;
  out.z_ref = count > 0 ? static_cast<double>(count) / sum : 1;
  const double z2 = out.z_ref * out.z_ref;
  for (std::size_t i = 0; i < scan.z_mm.size(); ++i)
    out.d.data[i] = static_cast<float>((1.0 / scan.z_mm.data[i] - 1.0 / out.z_ref) * z2);
  return out;
}

/// Least squares over the window centred at (cu, cv), value taken at (u, v).
PlaneFit fit_window(const InverseDepth& in, int u, int v, int cu, int cv, int half) {
  const Image<float>& d = in.d;
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, s = 0, xs = 0, ys = 0, ss = 0;
  const double base = d(u, v);
  for (int j = std::max(0, cv - half); j <= std::min(d.height - 1, cv + half); ++j)
    for (int i = std::max(0, cu - half); i <= std::min(d.width - 1, cu + half); ++i) {
      if (!std::isfinite(d(i, j))) continue;
      const double a = i - u, b = j - v, value = d(i, j) - base;
      n += 1, x += a, y += b, xx += a * a, xy += a * b, yy += b * b;
      s += value, xs += a * value, ys += b * value, ss += value * value;
    }
  PlaneFit out;
  if (n < std::max(3.0, kLeastShare * (2 * half + 1) * (2 * half + 1))) return out;
  const double cxx = xx - x * x / n, cxy = xy - x * y / n, cyy = yy - y * y / n;
  const double cxs = xs - x * s / n, cys = ys - y * s / n;
  const double determinant = cxx * cyy - cxy * cxy;
  if (determinant < 1e-6 * cxx * cyy || !(determinant > 0)) return out;
  out.slope_u = (cyy * cxs - cxy * cys) / determinant;
  out.slope_v = (cxx * cys - cxy * cxs) / determinant;
  out.at_pixel = base + (s - out.slope_u * x - out.slope_v * y) / n;
  const double squares = ss - s * s / n - out.slope_u * cxs - out.slope_v * cys;
  out.residual = std::sqrt(std::max(0.0, squares) / std::max(1.0, n - 3));
  out.valid = true;
  return out;
}

/// What noise of sd `sigma` and a radius of two windows leave in a window, and little more.
double residual_limit(int half, double sigma, double width_mm) {
  const double freedom = (2.0 * half + 1) * (2.0 * half + 1) - 3;
  return std::hypot(1.2 * sigma * (1 + 3.5 / std::sqrt(2 * freedom)), kBendShare * width_mm);
}

/// The best of the eight windows that have the pixel on their rim.
PlaneFit fit_on_rim(const InverseDepth& in, int u, int v, int half, double sigma) {
  PlaneFit best;
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du) {
      if (du == 0 && dv == 0) continue;
      const PlaneFit fit = fit_window(in, u, v, u + du * half, v + dv * half, half);
      if (!fit.valid || std::abs(fit.at_pixel - in.d(u, v)) > 4 * std::max(sigma, fit.residual)) continue;
      if (fit.residual < best.residual) best = fit;
    }
  return best;
}

/// A window that fails: beside an edge one on its rim fits far better; where all fail alike the surface bends, and the
/// window about the pixel errs least. \return whether it is the latter.
bool bends(const PlaneFit& centred, const PlaneFit& on_rim) {
  return centred.valid && (!on_rim.valid || on_rim.residual > 0.5 * centred.residual);
}

/// Beside an edge: windows on the rim at half the size, and again, until one fits.
PlaneFit fit_smaller(const InverseDepth& in, int u, int v, int half, PlaneFit best, double sigma, double pitch_mm) {
  for (int h = half; h >= 1; h /= 2) {
    if (h < half) {
      const PlaneFit fit = fit_on_rim(in, u, v, h, sigma);
      if (fit.residual < best.residual) best = fit;
    }
    if (best.residual <= residual_limit(h, sigma, (2 * h + 1) * pitch_mm)) break;
  }
  return best;
}

/// The least window whose normals are good to 1 deg at the scan's typical noise: sqrt(12) sigma / (p N^2).
int automatic_window(const Surfels& surfels, const InverseDepth& in) {
  std::vector<float> sigma(surfels.local_sigma_mm.data);
  std::nth_element(sigma.begin(), sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2), sigma.end());
  const double effective = sigma[sigma.size() / 2] * std::max(1.0, 3.54 * surfels.correlation_px);
  const double pitch = in.z_ref / std::max(in.scan.camera.fx, in.scan.camera.fy);
  const double window = std::sqrt(std::sqrt(12.0) * effective / (pitch * 1.0 * kDegree));
  return std::clamp(2 * static_cast<int>(std::ceil(0.5 * (window - 1))) + 1, 7, 15);
}

Image<Vec3f> by_inverse_depth(const Scan& scan, const Surfels& surfels, const InverseDepth& in, int window) {
  Image<Vec3f> normals(scan.width(), scan.height(), Vec3f::Zero());
  const int half = window / 2, n = surfels.cell_px;
  const std::vector<Vec3f> bias = bend_bias(surfels, window);
  const Image<float>& sigma_mm = surfels.local_sigma_mm;
  parallel_ranges(scan.height(), 8, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < scan.width(); ++u) {
        if (!std::isfinite(scan.z_mm(u, v))) continue;
        const double z = scan.z_mm(u, v), to_d = in.z_ref * in.z_ref / (z * z);
        const double pitch = z / std::min(scan.camera.fx, scan.camera.fy);
        const double sigma =
            to_d * sigma_mm(std::min(u / (8 * n), sigma_mm.width - 1), std::min(v / (8 * n), sigma_mm.height - 1));
        PlaneFit fit = fit_window(in, u, v, u, v, half);
        bool whole = fit.valid && fit.residual <= residual_limit(half, sigma, window * pitch * to_d);
        if (!whole) {
          const PlaneFit on_rim = fit_on_rim(in, u, v, half, sigma);
          whole = bends(fit, on_rim);
          if (!whole) fit = fit_smaller(in, u, v, half, on_rim, sigma, pitch * to_d);
        }
        if (!fit.valid) continue;
        Vec3 normal = in.normal(u, v, fit);
        const bool inside = surfels.surfel_of_cell.contains(u / n, v / n);
        const int surfel = inside ? surfels.surfel_of_cell(u / n, v / n) : -1;
        if (whole && surfel >= 0)
          normal = (normal - bias[static_cast<std::size_t>(surfel)].cast<double>()).normalized();
        normals(u, v) = normal.cast<float>();
      }
  });
  return normals;
}

}  // namespace

Image<Vec3f> pixel_normals(const Scan& scan, const NormalOptions& options) {
  const int window = options.window_px;
  if (window != 0 && (window < 3 || window > 31 || window % 2 == 0))
    throw Error(ErrorCode::bad_option,
                "a window of " + std::to_string(window) + " px was asked for, wanted an odd one of 3 to 31, or 0");
  const InverseDepth in = inverse_depth(scan);
  const Surfels surfels = surfels_from_scan(scan);
  const int size = window != 0 ? window : automatic_window(surfels, in);
  if (options.method == NormalMethod::tangent_mask) return tangent_mask_normals(scan, size);
  return by_inverse_depth(scan, surfels, in, size);
}

}  // namespace tribin
