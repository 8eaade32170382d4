#include "capture/ideal_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/core/vector_levels.hpp"

namespace tribin::capture_detail {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Median |change| of the columns along the rows.
float median_step(const Image<float>& column) {
  std::vector<float> steps;
  for (int v = 0; v < column.height; v += 8)
    for (int u = 0; u + 8 < column.width; u += 8) {
      const float step = std::abs(column(u + 8, v) - column(u, v)) / 8;  // over 8 px: noise counts for little
      if (std::isfinite(step)) steps.push_back(step);
    }
  if (steps.empty()) return 0;
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  return steps[steps.size() / 2];
}

/// Bilinear interpolation of four corners (row-wise), one of which may be NaN; NaN where more are, or where they are
/// more than `spread` apart.
float interpolate(std::array<float, 4> c, float a, float b, float spread) {
  const auto blend = [&] { return (1 - b) * ((1 - a) * c[0] + a * c[1]) + b * ((1 - a) * c[2] + a * c[3]); };
  if (std::isfinite(c[0] + c[1] + c[2] + c[3])) {  // nearly always all four, or none
    const float low = std::min(std::min(c[0], c[1]), std::min(c[2], c[3])),
                high = std::max(std::max(c[0], c[1]), std::max(c[2], c[3]));
    return high - low > spread ? kNaN : blend();
  }
  int missing = -1, count = 0;
  for (int i = 0; i < 4; ++i)
    if (!std::isfinite(c[static_cast<std::size_t>(i)])) missing = i, ++count;
  if (count > 1) return kNaN;
  // The corner opposite to i is 3 - i: the plane through three corners.
  const auto at = [&](int i) { return c[static_cast<std::size_t>(i)]; };
  c[static_cast<std::size_t>(missing)] = at(missing ^ 1) + at(missing ^ 2) - at(missing ^ 3);
  const auto [low, high] = std::minmax_element(c.begin(), c.end());
  if (*high - *low > spread) return kNaN;
  return blend();
}

/// Where a camera sees the rays first + u * step, u = 0 .. n - 1 [px]; -1, -1 behind it. One vector loop.
TRIBIN_VECTOR_LEVELS void place_row(const RigCamera& camera, const Vec3& first, const Vec3& step, int n,
                                    double* __restrict out_u, double* __restrict out_v) {
  const double k1 = camera.distortion[0], k2 = camera.distortion[1], p1 = camera.distortion[2],
               p2 = camera.distortion[3], k3 = camera.distortion[4];
  const double fx = camera.camera.fx, fy = camera.camera.fy, cx = camera.camera.cx, cy = camera.camera.cy;
  const double x0 = first.x(), y0 = first.y(), z0 = first.z(), x1 = step.x(), y1 = step.y(), z1 = step.z();
  for (int u = 0; u < n; ++u) {
    const double z = z0 + u * z1, inverse = 1 / z, x = (x0 + u * x1) * inverse, y = (y0 + u * y1) * inverse;
    const double r2 = x * x + y * y, radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double dx = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
    const double dy = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
    const double pu = fx * dx + cx, pv = fy * dy + cy;
    out_u[u] = z > 0 ? pu : -1;
    out_v[u] = z > 0 ? pv : -1;
  }
}

/// The corners of a distorted camera's image on the view, [px] with principal point 0.
std::array<Vec2, 4> corners(const RigCamera& c, const Matrix3& view_from_camera, double focal) {
  std::array<Vec2, 4> out;
  for (int i = 0; i < 4; ++i) {
    const double u = i & 1 ? c.camera.width - 1 : 0, v = i & 2 ? c.camera.height - 1 : 0;
    const Vec3 ray = c.camera.ray(u, v);
    const std::optional<Vec2> ideal = undistorted(c.distortion, {ray.x(), ray.y()});
    if (!ideal)
      throw Error(ErrorCode::bad_input, "camera " + c.name +
                                            ": distortion: saw a model that folds the image in its corner, "
                                            "wanted one that holds up to there");
    const Vec3 turned = view_from_camera * Vec3(ideal->x(), ideal->y(), 1);
    out[static_cast<std::size_t>(i)] = focal * Vec2(turned.x() / turned.z(), turned.y() / turned.z());
  }
  return out;
}

}  // namespace

RigCamera with_size_of(const Decoded& decoded, RigCamera camera, const std::string& source) {
  if (camera.camera.width == 0) {
    camera.camera.width = decoded.width();
    camera.camera.height = decoded.height();
  }
  if (camera.camera.width != decoded.width() || camera.camera.height != decoded.height())
    throw Error(ErrorCode::bad_input, source + ": camera " + camera.name + ": saw frames of " +
                                          std::to_string(decoded.width()) + " x " + std::to_string(decoded.height()) +
                                          ", wanted " + std::to_string(camera.camera.width) + " x " +
                                          std::to_string(camera.camera.height) + " as calibrated");
  if (decoded.column.empty())
    throw Error(ErrorCode::bad_input,
                "camera " + camera.name + ": saw frames without column patterns, wanted them (vertical stripes)");
  return camera;
}

IdealView undistorted_view(const RigCamera& camera) { return {camera.camera, Matrix3::Identity()}; }

std::pair<IdealView, IdealView> rectified_views(const RigCamera& first, const RigCamera& second) {
  const Pose second_from_first = second.rig_from_camera.inverse() * first.rig_from_camera;
  // Each camera turns half of the way; then both turn about the same axis until the baseline is the x axis.
  const Matrix3 half = rotation_from_vector(-0.5 * vector_from_rotation(second_from_first.linear()));
  const Vec3 t = half * second_from_first.translation();
  if (std::abs(t.x()) < std::abs(t.y()) || t.norm() < 1e-6)
    throw Error(ErrorCode::bad_input, "cameras " + first.name + " and " + second.name +
                                          ": saw them one above the other (or in one place), wanted them side by side");
  const Vec3 to(t.x() > 0 ? 1 : -1, 0, 0), axis = t.cross(to);
  Matrix3 level = Matrix3::Identity();
  if (axis.norm() > 1e-12 * t.norm())
    level = rotation_from_vector(axis.normalized() * std::acos(std::min(1.0, std::abs(t.x()) / t.norm())));
  const Matrix3 first_view = level * half.transpose(), second_view = level * half;

  double focal = std::numeric_limits<double>::max();
  for (const RigCamera* c : {&first, &second}) {
    double f = c->camera.fy;
    // Barrel distortion: a smaller focal length keeps the middle of the image from being stretched.
    const double k1 = c->distortion[0];
    if (k1 < 0) f *= 1 + k1 * (std::pow(c->camera.width, 2) + std::pow(c->camera.height, 2)) / (4 * f * f);
    focal = std::min(focal, f);
  }
  IdealView a{first.camera, first_view.transpose()}, b{second.camera, second_view.transpose()};
  const std::array<std::pair<const RigCamera*, IdealView*>, 2> both = {{{&first, &a}, {&second, &b}}};
  double cy = 0;
  for (const auto& [camera, view] : both) {
    Vec2 middle = Vec2::Zero();
    for (const Vec2& corner : corners(*camera, view->camera_from_view.transpose(), focal)) middle += 0.25 * corner;
    PinholeCamera& p = view->pinhole;
    p.fx = p.fy = focal;
    p.cx = 0.5 * (camera->camera.width - 1) - middle.x();
    cy += 0.5 * (0.5 * (camera->camera.height - 1) - middle.y());
  }
  a.pinhole.cy = b.pinhole.cy = cy;
  return {a, b};
}

ViewImage resample(const Decoded& decoded, const RigCamera& camera, const IdealView& view) {
  const int w = view.pinhole.width, h = view.pinhole.height;
  ViewImage out;
  out.column = out.brightness = Image<float>(w, h, kNaN);
  if (!decoded.row.empty()) out.row = Image<float>(w, h, kNaN);
  out.modulation = Image<std::uint8_t>(w, h, 0);
  out.invalid_reason = Image<std::uint8_t>(w, h, static_cast<std::uint8_t>(Invalid::out_of_view));
  out.step = median_step(decoded.column);
  bool straight = view.camera_from_view.isIdentity();
  for (const double d : camera.distortion) straight &= d == 0;
  out.noise_share = straight ? 1 : 4.0 / 9;  // mean of the sum of squared bilinear weights
  const PinholeCamera& c = camera.camera;
  const PinholeCamera& pinhole = view.pinhole;
  parallel_ranges(h, 32, [&](int begin, int end) {
    std::vector<double> at_u(static_cast<std::size_t>(w)), at_v(at_u.size());
    for (int v = begin; v < end; ++v) {
      if (straight) {
        std::iota(at_u.begin(), at_u.end(), 0.0);
        std::fill(at_v.begin(), at_v.end(), v);
      } else {
        place_row(camera, view.camera_from_view * pinhole.ray(0, v), view.camera_from_view * Vec3(1 / pinhole.fx, 0, 0),
                  w, at_u.data(), at_v.data());
      }
      for (int u = 0; u < w; ++u) {
        const double x = at_u[static_cast<std::size_t>(u)], y = at_v[static_cast<std::size_t>(u)];
        if (!(x >= 0 && y >= 0 && x <= c.width - 1 && y <= c.height - 1)) continue;
        const int u0 = std::min(static_cast<int>(x), c.width - 2), v0 = std::min(static_cast<int>(y), c.height - 2);
        const float a = static_cast<float>(x - u0), b = static_cast<float>(y - v0);
        const int nearest_u = u0 + (a > 0.5f), nearest_v = v0 + (b > 0.5f);
        out.modulation(u, v) = decoded.modulation(nearest_u, nearest_v);
        const auto corners_of = [&](const auto& image) {
          return std::array<float, 4>{static_cast<float>(image(u0, v0)), static_cast<float>(image(u0 + 1, v0)),
                                      static_cast<float>(image(u0, v0 + 1)), static_cast<float>(image(u0 + 1, v0 + 1))};
        };
        constexpr float kAny = 1e30f;
        out.brightness(u, v) = interpolate(corners_of(decoded.brightness), a, b, kAny);
        // A surface at three times the usual slant, both ways, and five sigma of four columns: what is more is a jump.
        const float noise = static_cast<float>(decoded.column_noise) / std::max<float>(1, out.modulation(u, v));
        const float column =
            straight ? decoded.column(u, v) : interpolate(corners_of(decoded.column), a, b, 6 * out.step + 7 * noise);
        std::uint8_t reason = decoded.invalid_reason(nearest_u, nearest_v);
        if (std::isfinite(column)) {
          reason = static_cast<std::uint8_t>(Invalid::measured);
        } else if (reason == static_cast<std::uint8_t>(Invalid::measured)) {
          reason = static_cast<std::uint8_t>(Invalid::lost);
          for (int k = 0; k < 4; ++k)  // a neighbour's reason, where one is missing
            if (const std::uint8_t r = decoded.invalid_reason(u0 + (k & 1), v0 + (k >> 1)); r != 0) reason = r;
        }
        out.column(u, v) = column;
        out.invalid_reason(u, v) = reason;
        if (!out.row.empty())
          out.row(u, v) = straight ? decoded.row(u, v) : interpolate(corners_of(decoded.row), a, b, kAny);
      }
    }
  });
  return out;
}

}  // namespace tribin::capture_detail
