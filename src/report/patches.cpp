#include "report/patches.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "report/shapes.hpp"

namespace tribin::report {
namespace {

/// A map of a primitive's surface onto a plane [mm]; round surfaces are unrolled, cut on the side away from `towards`.
struct Chart {
  const Primitive& p;
  Vec3 u, v, axis;
  double scale = 1;  ///< mm a radian, cylinder and cone

  Chart(const Primitive& primitive, const std::vector<Vec3>& points) : p(primitive), axis(primitive.axis) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& x : points) middle += x / static_cast<double>(points.size());
    Vec3 towards = middle - p.point;
    if (p.type == PrimitiveType::sphere) axis = towards.normalized();
    orthonormal_basis(axis, u, v);
    if (p.type == PrimitiveType::cylinder || p.type == PrimitiveType::cone || p.type == PrimitiveType::torus) {
      towards -= axis * axis.dot(towards);
      if (towards.norm() > 1e-9) u = towards.normalized(), v = axis.cross(u);
      scale = p.radius_mm;
    }
    if (p.type == PrimitiveType::cone) scale = std::max(1e-3, (middle - p.point).norm() * std::sin(p.half_angle));
    if (p.type == PrimitiveType::sphere) scale = p.radius_mm;
  }

  Vec2 flat(const Vec3& x) const {
    const Vec3 d = x - p.point;
    const double a = d.dot(u), b = d.dot(v), c = d.dot(axis);
    switch (p.type) {
      case PrimitiveType::plane:
        return {a, b};
      case PrimitiveType::cylinder:
        return {scale * std::atan2(b, a), c};
      case PrimitiveType::cone:
        return {scale * std::atan2(b, a), c / std::cos(p.half_angle)};
      case PrimitiveType::sphere: {
        const double turn = scale * std::atan2(std::hypot(a, b), c), length = std::hypot(a, b);
        return length > 1e-12 ? Vec2(a / length * turn, b / length * turn) : Vec2(0, 0);
      }
      case PrimitiveType::torus:  // round the axis, and round the tube from its outside
        return {scale * std::atan2(b, a), p.minor_radius_mm * std::atan2(c, std::hypot(a, b) - p.radius_mm)};
    }
    return {0, 0};
  }

  ShapePoint on_surface(const Vec2& at) const {
    switch (p.type) {
      case PrimitiveType::plane:
        return nearest_on(p, p.point + at.x() * u + at.y() * v);
      case PrimitiveType::cylinder: {
        const double t = at.x() / scale;
        return nearest_on(p, p.point + p.radius_mm * (std::cos(t) * u + std::sin(t) * v) + at.y() * axis);
      }
      case PrimitiveType::cone: {
        const double t = at.x() / scale, radius = at.y() * std::sin(p.half_angle);
        return nearest_on(
            p, p.point + radius * (std::cos(t) * u + std::sin(t) * v) + at.y() * std::cos(p.half_angle) * axis);
      }
      case PrimitiveType::sphere: {
        const double turn = at.norm() / scale;
        const Vec2 side = turn > 1e-12 ? Vec2(at / at.norm()) : Vec2(0, 0);
        return nearest_on(
            p, p.point + p.radius_mm * (std::sin(turn) * (side.x() * u + side.y() * v) + std::cos(turn) * axis));
      }
      case PrimitiveType::torus: {
        const double t = at.x() / scale, tube = at.y() / p.minor_radius_mm;
        const Vec3 out = std::cos(t) * u + std::sin(t) * v;
        return nearest_on(p, p.point + (p.radius_mm + p.minor_radius_mm * std::cos(tube)) * out +
                                 p.minor_radius_mm * std::sin(tube) * axis);
      }
    }
    return {};
  }
};

/// True within `reach` cells of a true (or, eroding, of a false) one.
Image<std::uint8_t> grown(const Image<std::uint8_t>& cells, int reach, bool value) {
  Image<std::uint8_t> out = cells;
  for (int v = 0; v < cells.height; ++v)
    for (int u = 0; u < cells.width; ++u) {
      if ((cells(u, v) != 0) != value) continue;
      for (int dv = -reach; dv <= reach; ++dv)
        for (int du = -reach; du <= reach; ++du)
          if (du * du + dv * dv <= reach * reach + 1 && out.contains(u + du, v + dv)) out(u + du, v + dv) = value;
    }
  return out;
}

void add_patch(const Primitive& p, const std::vector<Vec3>& points, double cell_mm, ShadedSurface& out) {
  constexpr int kClosed = 2;  // cells: a gap of four is bridged, where pixels lie thin on a slope
  const Chart chart(p, points);
  std::vector<Vec2> flat;
  Vec2 low = Vec2::Constant(1e300), high = Vec2::Constant(-1e300);
  for (const Vec3& x : points) {
    flat.push_back(chart.flat(x));
    low = low.cwiseMin(flat.back()), high = high.cwiseMax(flat.back());
  }
  const Vec2 size = (high - low) / cell_mm;
  if (!(size.x() < 4000 && size.y() < 4000)) return;
  constexpr int kMargin = kClosed + 2;
  Image<std::uint8_t> cells(static_cast<int>(size.x()) + 1 + 2 * kMargin, static_cast<int>(size.y()) + 1 + 2 * kMargin);
  for (const Vec2& x : flat)
    cells(static_cast<int>((x.x() - low.x()) / cell_mm) + kMargin,
          static_cast<int>((x.y() - low.y()) / cell_mm) + kMargin) = 1;
  cells = grown(grown(cells, kClosed, true), kClosed, false);
  std::map<std::size_t, std::uint32_t> corners;
  const auto corner = [&](int a, int b) {
    const auto [at, made] = corners.emplace(static_cast<std::size_t>(b) * (cells.width + 1) + a,
                                            static_cast<std::uint32_t>(out.vertices.size()));
    if (made) {
      const ShapePoint on = chart.on_surface(low + cell_mm * Vec2(a - kMargin, b - kMargin));
      out.vertices.push_back(on.point.cast<float>());
      out.normals.push_back(on.normal.cast<float>());
    }
    return at->second;
  };
  for (int b = 0; b < cells.height; ++b)
    for (int a = 0; a < cells.width; ++a) {
      if (!cells(a, b)) continue;
      const std::uint32_t k[4] = {corner(a, b), corner(a + 1, b), corner(a + 1, b + 1), corner(a, b + 1)};
      out.triangles.push_back({k[0], k[1], k[2]});
      out.triangles.push_back({k[0], k[2], k[3]});
      for (int i = 0; i < 2; ++i) {
        out.materials.push_back(material_of(p.type));
        out.tints.push_back(tint_of(p.id));
        out.ids.push_back(static_cast<std::uint16_t>(p.id));
      }
    }
}

}  // namespace

ShadedSurface patches_of(const Scan& scan, const Sighting& where,
                         const std::function<const Primitive*(int u, int v)>& label) {
  std::map<int, std::pair<const Primitive*, std::vector<Vec3>>> seen;
  double depth = 0;
  std::size_t count = 0;
  for (int v = where.v0; v < where.v1; ++v)
    for (int u = where.u0; u < where.u1; ++u) {
      const Primitive* p = scan.z_mm(u, v) > 0 ? label(u, v) : nullptr;
      if (!p) continue;
      auto& [primitive, points] = seen[p->id];
      primitive = p;
      points.push_back(scan.point(u, v));
      depth += scan.z_mm(u, v), ++count;
    }
  ShadedSurface out;
  if (count == 0) return out;
  // Two pixels a cell, but no more than some 300 cells across the rectangle: finer is not seen in the picture.
  const double pitch = depth / static_cast<double>(count) / scan.camera.fx;
  const double cell = pitch * std::max(2.0, std::max(where.u1 - where.u0, where.v1 - where.v0) / 300.0);
  for (const auto& [id, found] : seen) add_patch(*found.first, found.second, cell, out);
  out.steps.assign(out.triangles.size(), 0);
  return out;
}

}  // namespace tribin::report
