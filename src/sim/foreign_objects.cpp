#include "sim/foreign_objects.hpp"

#include <cmath>

namespace tribin::sim {
namespace {

/// A prism over a closed outline (counter-clockwise, seen from +z), from z = 0 to `height`. With an inner outline of as
/// many corners it is a tube; without one the outline must be star-shaped about its first corner.
Mesh prism(const std::vector<Vec2>& outer, const std::vector<Vec2>& inner, double height, const char* name) {
  Mesh mesh;
  mesh.name = name;
  const auto n = static_cast<std::uint32_t>(outer.size());
  const auto ring = [&](const std::vector<Vec2>& outline, double z) {
    for (const Vec2& p : outline) mesh.vertices.push_back(Vec3(p.x(), p.y(), z).cast<float>());
  };
  const auto quads = [&](std::uint32_t from, std::uint32_t to) {  // outward when `to` lies above an outer ring `from`
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t k = (i + 1) % n;
      mesh.triangles.push_back({from + i, from + k, to + k});
      mesh.triangles.push_back({from + i, to + k, to + i});
    }
  };
  ring(outer, 0), ring(outer, height);
  quads(0, n);
  if (inner.empty()) {
    for (std::uint32_t i = 1; i + 1 < n; ++i) {
      mesh.triangles.push_back({0, i + 1, i});
      mesh.triangles.push_back({n, n + i, n + i + 1});
    }
  } else {
    ring(inner, 0), ring(inner, height);
    quads(n, 3 * n);      // top
    quads(3 * n, 2 * n);  // inside
    quads(2 * n, 0);      // bottom
  }
  return mesh;
}

std::vector<Vec2> circle(double radius, int corners) {
  std::vector<Vec2> points;
  for (int i = 0; i < corners; ++i) {
    const double a = 2 * kPi * i / corners;
    points.push_back(radius * Vec2(std::cos(a), std::sin(a)));
  }
  return points;
}

}  // namespace

std::vector<Mesh> foreign_objects(double size_mm) {
  constexpr int kRound = 96;  // corners of a circle: a chord error of 0.05 % of the radius
  const double s = size_mm;
  const auto rectangle = [](double x, double y) { return std::vector<Vec2>{{0, 0}, {x, 0}, {x, y}, {0, y}}; };
  const double leg = 0.5 * s, thick = 0.08 * s;
  return {
      prism(rectangle(0.5 * s, 0.3 * s), {}, 0.2 * s, "foreign_block"),
      prism(circle(0.09 * s, kRound), {}, 0.9 * s, "foreign_bar"),
      prism(circle(0.25 * s, kRound), circle(0.2 * s, kRound), 0.35 * s, "foreign_tube"),
      prism(circle(0.27 * s, 6), {}, 0.2 * s, "foreign_hexagon"),
      // Star-shaped about its inner corner, which comes first.
      prism({{thick, thick}, {thick, leg}, {0, leg}, {0, 0}, {leg, 0}, {leg, thick}}, {}, 0.4 * s, "foreign_angle")};
}

}  // namespace tribin::sim
