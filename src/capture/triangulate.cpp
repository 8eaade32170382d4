#include "tribin/capture/triangulate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/epipolar.hpp"
#include "capture/ideal_view.hpp"
#include "capture/stereo_match.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using namespace capture_detail;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A scan with the view's grid and nothing measured yet.
Triangulated start(const RigCamera& camera, const IdealView& view, const ViewImage& seen) {
  Triangulated out;
  out.scan.camera = view.pinhole;
  out.scan.z_mm = Image<float>(view.pinhole.width, view.pinhole.height, kNaN);
  out.scan.modulation = seen.modulation;
  out.scan.invalid_reason = seen.invalid_reason;
  out.rig_from_scan = camera.rig_from_camera;
  out.rig_from_scan.linear() = camera.rig_from_camera.linear() * view.camera_from_view;
  out.column = seen.column;
  return out;
}

/// The scan's noise at its median depth, from the sd of each pixel: median of sigma / z^2, which geometry leaves alone.
void set_noise(const Image<float>& sigma, Scan& scan) {
  std::vector<float> depth, relative;
  for (std::size_t i = 0; i < sigma.size(); i += 3) {  // enough for medians
    const float z = scan.z_mm.data[i];
    if (!std::isfinite(z)) continue;
    depth.push_back(z);
    relative.push_back(sigma.data[i] / (z * z));
  }
  if (depth.empty()) return;
  const auto middle = [](std::vector<float>& values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return static_cast<double>(values[values.size() / 2]);
  };
  const double z = middle(depth);
  scan.noise.sigma_mm = middle(relative) * z * z;
}

void lose(Scan& scan, int u, int v, Invalid why) {
  scan.z_mm(u, v) = kNaN;
  scan.invalid_reason(u, v) = static_cast<std::uint8_t>(why);
}

/// Depth along a ray at which the projector shows a column, and its change with the column.
struct Crossing {
  double z = 0, slope = 0;
  double row = 0;  ///< of the projector there [px]
};

/// \param bent  whether the projector has distortion. \param r  the ray's direction, z = 1 in the view, in the
/// projector's axes; \param t  the view's origin there.
Crossing cross(const RigCamera& projector, bool bent, const Vec3& r, const Vec3& t, double column) {
  const PinholeCamera& c = projector.camera;
  const double wanted = (column - c.cx) / c.fx, enough = 1e-6 / c.fx;
  double x = wanted, off = 0;
  Crossing out;
  // The plane of ideal points with this x meets the ray somewhere; there the lens puts x elsewhere than wanted, by the
  // error of x and a little: each round leaves the distortion's slope of it, a tenth or less.
  constexpr int kRounds = 12;
  for (int round = 0; round < kRounds; ++round) {
    const double below = r.x() - x * r.z();
    out.z = (x * t.z() - t.x()) / below;
    out.slope = (t.z() + out.z * r.z()) / below / c.fx;
    const Vec3 p = r * out.z + t;
    const Vec2 ideal(p.x() / p.z(), p.y() / p.z());
    const Vec2 seen = bent ? distorted(projector.distortion, ideal) : ideal;
    out.row = c.fy * seen.y() + c.cy;
    off = bent ? wanted - seen.x() : 0;
    if (std::abs(off) < enough) return out;
    x += off;
  }
  return {std::nan(""), 0, 0};  // the model folds the image there
}

}  // namespace

Triangulated triangulate(const Rig& rig, const Decoded& decoded) {
  if (!rig.projector)
    throw Error(ErrorCode::bad_input,
                rig.source + ": saw one camera without a projector, wanted a calibrated projector or a second camera");
  TRIBIN_ASSERT(!rig.cameras.empty());
  const RigCamera camera = with_size_of(decoded, rig.cameras[0], rig.source);
  const IdealView view = undistorted_view(camera);
  const ViewImage seen = resample(decoded, camera, view);
  Triangulated out = start(camera, view, seen);
  out.scan.warnings = decoded.warnings;
  Scan& scan = out.scan;
  const Pose projector_from_view = rig.projector->rig_from_camera.inverse() * out.rig_from_scan;
  const double noise = decoded.column_noise * std::sqrt(seen.noise_share);
  bool bent = false;
  for (const double d : rig.projector->distortion) bent |= d != 0;
  Image<float> sigma(scan.width(), scan.height(), 0), off_row(scan.width(), scan.height(), kNaN);
  parallel_ranges(scan.height(), 32, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < scan.width(); ++u) {
        const float column = seen.column(u, v);
        if (!std::isfinite(column)) continue;
        const Crossing at = cross(*rig.projector, bent, projector_from_view.linear() * view.pinhole.ray(u, v),
                                  projector_from_view.translation(), column);
        if (!(at.z > 0) || !std::isfinite(at.z)) {
          lose(scan, u, v, Invalid::out_of_view);
          continue;
        }
        const double modulation = std::max<double>(1, seen.modulation(u, v));
        if (!seen.row.empty() && std::isfinite(seen.row(u, v))) {
          off_row(u, v) = static_cast<float>(seen.row(u, v) - at.row);
          if (std::abs(off_row(u, v)) > 5 * decoded.row_noise / modulation + 2) {
            lose(scan, u, v, Invalid::unmatched);
            continue;
          }
        }
        scan.z_mm(u, v) = static_cast<float>(at.z);
        sigma(u, v) = static_cast<float>(std::abs(at.slope) * noise / modulation);
      }
  });
  set_noise(sigma, scan);
  std::vector<double> rows;
  for (std::size_t i = 0; i < off_row.size(); i += 7)
    if (std::isfinite(off_row.data[i])) rows.push_back(off_row.data[i]);
  out.epipolar = summary_of(std::move(rows));
  warn_of_calibration(out.epipolar, scan);
  return out;
}

Triangulated triangulate(const Rig& rig, const Decoded& first, const Decoded& second) {
  TRIBIN_ASSERT(rig.cameras.size() >= 2);
  const RigCamera a = with_size_of(first, rig.cameras[0], rig.source),
                  b = with_size_of(second, rig.cameras[1], rig.source);
  const auto [view_a, view_b] = rectified_views(a, b);
  const ViewImage seen_a = resample(first, a, view_a), seen_b = resample(second, b, view_b);
  Triangulated out = start(a, view_a, seen_a);
  out.scan.warnings = first.warnings;
  out.scan.warnings.insert(out.scan.warnings.end(), second.warnings.begin(), second.warnings.end());
  Scan& scan = out.scan;
  const StereoMatch match = match_columns(seen_a, seen_b);
  // The second camera on the first view's x axis.
  const Vec3 place = out.rig_from_scan.inverse() * b.rig_from_camera.translation();
  const double scale = view_a.pinhole.fx * place.x(), shift = view_a.pinhole.cx - view_b.pinhole.cx;
  Image<float> sigma(scan.width(), scan.height(), 0);
  parallel_ranges(scan.height(), 32, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < scan.width(); ++u) {
        if (!std::isfinite(seen_a.column(u, v))) continue;
        const double disparity = u - match.column(u, v) - shift, z = scale / disparity;
        if (!std::isfinite(disparity) || !(z > 0) || !std::isfinite(z)) {
          lose(scan, u, v, Invalid::unmatched);
          continue;
        }
        scan.z_mm(u, v) = static_cast<float>(z);
        const double m1 = std::max<double>(1, seen_a.modulation(u, v));
        const double one = first.column_noise / m1,
                     other = second.column_noise / m1 * (first.image_noise / second.image_noise);
        const double column =
            std::sqrt(seen_a.noise_share * one * one + seen_b.noise_share * other * other * match.noise_share(u, v));
        sigma(u, v) = static_cast<float>(z * z / std::abs(scale) * column / match.slope(u, v));
      }
  });
  set_noise(sigma, scan);
  out.epipolar = check_epipolar(seen_a, seen_b, match.column);
  warn_of_calibration(out.epipolar, scan);
  return out;
}

}  // namespace tribin
