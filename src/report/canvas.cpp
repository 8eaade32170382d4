#include "report/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tribin::report {
namespace {

/// Calls pixel(u, v, weights) for the pixel centres inside a triangle of the picture.
template <class Pixel>
void for_pixels(const Vec3 (&p)[3], int width, int height, const Pixel& pixel) {
  const double area = (p[1].x() - p[0].x()) * (p[2].y() - p[0].y()) - (p[1].y() - p[0].y()) * (p[2].x() - p[0].x());
  if (std::abs(area) < 1e-12) return;
  const auto [x0, x1] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
  const auto [y0, y1] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
  if (!(x1 >= 0 && y1 >= 0 && x0 <= width && y0 <= height)) return;
  const int u0 = static_cast<int>(std::max(0.0, std::ceil(x0))), u1 = static_cast<int>(std::min(width - 1.0, x1));
  const int v0 = static_cast<int>(std::max(0.0, std::ceil(y0))), v1 = static_cast<int>(std::min(height - 1.0, y1));
  constexpr double kRim = -1e-9;  // pixels on a shared edge belong to both
  for (int v = v0; v <= v1; ++v) {
    for (int u = u0; u <= u1; ++u) {
      const double w1 = ((u - p[0].x()) * (p[2].y() - p[0].y()) - (v - p[0].y()) * (p[2].x() - p[0].x())) / area;
      const double w2 = ((p[1].x() - p[0].x()) * (v - p[0].y()) - (p[1].y() - p[0].y()) * (u - p[0].x())) / area;
      const double w0 = 1 - w1 - w2;
      if (w0 >= kRim && w1 >= kRim && w2 >= kRim) pixel(u, v, w0, w1, w2);
    }
  }
}

/// Light from the upper left, over the viewer's shoulder, and a little from everywhere.
double shade_of(Vec3 normal) {
  if (normal.z() > 0) normal = -normal;  // towards the viewer
  static const Vec3 kLight = Vec3(-0.45, -0.62, -0.64).normalized();
  const double lit = std::max(0.0, normal.dot(kLight)), facing = -normal.z();
  return 0.16 + 0.52 * lit + 0.24 * facing + 0.12 * std::pow(lit, 24);
}

}  // namespace

View view_along(const Vec3& direction, const Vec3& down, const Vec3& center, double width_mm, int width, int height) {
  View view;
  const Vec3 z = direction.normalized();
  const Vec3 x = down.cross(z).normalized();
  view.view_from_world.row(0) = x.transpose();
  view.view_from_world.row(1) = z.cross(x).transpose();
  view.view_from_world.row(2) = z.transpose();
  view.center = center;
  view.px_per_mm = width / width_mm;
  view.width = width;
  view.height = height;
  return view;
}

void Canvas::draw(const ShadedSurface& s) {
  std::vector<Vec3> projected(s.vertices.size());
  for (std::size_t i = 0; i < projected.size(); ++i) projected[i] = view.project(s.vertices[i].cast<double>());
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const auto& [a, b, c] = s.triangles[t];
    const Vec3 p[3] = {projected[a], projected[b], projected[c]};
    const double tint = s.tints.empty() ? 0 : s.tints[t];
    const int step = s.steps.empty() ? 0 : s.steps[t];
    const Vec3 e1 = s.vertices[b].cast<double>() - s.vertices[a].cast<double>();
    const Vec3 e2 = s.vertices[c].cast<double>() - s.vertices[a].cast<double>();
    const Vec3 flat = view.view_from_world * e1.cross(e2).normalized();
    Vec3 n[3] = {flat, flat, flat};
    if (!s.normals.empty()) {
      const std::uint32_t corner[3] = {a, b, c};
      for (int i = 0; i < 3; ++i) {
        n[i] = view.view_from_world * s.normals[corner[i]].cast<double>();
        if (n[i].z() > 0) n[i] = -n[i];
      }
    }
    for_pixels(p, indices.width, indices.height, [&](int u, int v, double w0, double w1, double w2) {
      const float z = static_cast<float>(w0 * p[0].z() + w1 * p[1].z() + w2 * p[2].z());
      if (z >= depth(u, v)) return;
      depth(u, v) = z;
      const Vec3 normal = (w0 * n[0] + w1 * n[1] + w2 * n[2]).normalized();
      indices(u, v) = index_of(s.materials[t], shade_of(normal) + tint, step);
      ids(u, v) = s.ids.empty() ? std::uint16_t{0} : s.ids[t];
    });
  }
}

void Canvas::line(const Vec3& a, const Vec3& b, Material material, double width_px, double slack_mm) {
  const Vec3 p = view.project(a), q = view.project(b);
  const int steps = std::max(1, static_cast<int>(std::ceil((q - p).head<2>().norm() * 2)));
  const int reach = static_cast<int>(std::ceil(width_px / 2));
  const std::uint8_t index = index_of(material, 0.5);
  for (int i = 0; i <= steps; ++i) {
    const Vec3 at = p + (q - p) * (static_cast<double>(i) / steps);
    const int u0 = static_cast<int>(std::lround(at.x())), v0 = static_cast<int>(std::lround(at.y()));
    if (!indices.contains(u0, v0)) continue;
    float behind = depth(u0, v0);  // of the neighbours too: a silhouette's own pixel may hold the face in front of it
    for (int v = v0 - 1; v <= v0 + 1; ++v)
      for (int u = u0 - 1; u <= u0 + 1; ++u)
        if (depth.contains(u, v)) behind = std::max(behind, depth(u, v));
    if (at.z() > behind + slack_mm) continue;
    for (int v = v0 - reach; v <= v0 + reach; ++v)
      for (int u = u0 - reach; u <= u0 + reach; ++u)
        if (indices.contains(u, v) && std::hypot(u - at.x(), v - at.y()) <= 0.5 * width_px) indices(u, v) = index;
  }
}

Image<float> depth_of(const std::vector<Vec3f>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                      const Pose& camera_from_part, const PinholeCamera& camera) {
  // 1/z is linear over the picture of a plane.
  std::vector<Vec3> projected(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3 p = camera_from_part * vertices[i].cast<double>();
    const Vec2 px = p.z() > 1e-3 ? camera.project(p) : Vec2(NAN, NAN);
    projected[i] = {px.x(), px.y(), 1 / p.z()};
  }
  Image<float> inverse(camera.width, camera.height, 0.f);
  for (const auto& [a, b, c] : triangles) {
    const Vec3 p[3] = {projected[a], projected[b], projected[c]};
    if (!p[0].allFinite() || !p[1].allFinite() || !p[2].allFinite()) continue;
    for_pixels(p, camera.width, camera.height, [&](int u, int v, double w0, double w1, double w2) {
      inverse(u, v) = std::max(inverse(u, v), static_cast<float>(w0 * p[0].z() + w1 * p[1].z() + w2 * p[2].z()));
    });
  }
  for (float& value : inverse.data) value = value > 0 ? 1 / value : std::numeric_limits<float>::quiet_NaN();
  return inverse;
}

}  // namespace tribin::report
