#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "part/shapes.hpp"

namespace tribin::test {

// Five parts that one small feature keeps from being symmetric: a hole, a flat, a chamfer, a slot and a boss of 1 to
// 3 mm on plain bodies. All but the plate turn over into themselves about the axis through their feature.

/// A prism between z = 0 and z = height over an outline that all of can be seen from the origin.
inline Mesh prism(const Outline& outline, double height) {
  Mesh mesh;
  const auto lift = [](const Vec2& p, double z) { return Vec3(p.x(), p.y(), z); };
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec2 a = outline[i], b = outline[(i + 1) % outline.size()];
    add_triangle(mesh, Vec3(0, 0, height), lift(a, height), lift(b, height));
    add_triangle(mesh, Vec3(0, 0, 0), lift(b, 0), lift(a, 0));
    add_quad(mesh, lift(a, 0), lift(b, 0), lift(b, height), lift(a, height));
  }
  return mesh;
}

/// Corners of an arc about the origin, both ends included.
inline void add_arc(Outline& outline, double radius, double from, double to, int steps) {
  for (int i = 0; i <= steps; ++i) {
    const double angle = from + (to - from) * i / steps;
    outline.push_back(radius * Vec2(std::cos(angle), std::sin(angle)));
  }
}

/// 60 x 60 x 12, a through hole of 3 mm off every centre line.
inline Mesh plate_with_small_hole() { return plate_with_hole(rectangle(30, 30), 12, {20, 12}, 1.5); }

/// A bar of 50 across, 70 long, with a flat 1.5 mm deep along it.
inline Mesh bar_with_flat() {
  constexpr double kRadius = 25, kDepth = 1.5;
  const double half = std::acos((kRadius - kDepth) / kRadius);
  Outline outline;
  add_arc(outline, kRadius, half, 2 * kPi - half, 140);
  return prism(outline, 70);
}

/// 50 x 50 x 30, one upright edge broken by 3 mm.
inline Mesh block_with_chamfer() { return prism({{25, 22}, {22, 25}, {-25, 25}, {-25, -25}, {25, -25}}, 30); }

/// A disc of 60 across, 14 thick, with a slot 3 mm wide and deep in its rim.
inline Mesh disc_with_slot() {
  constexpr double kRadius = 30;
  const double half = std::asin(1.5 / kRadius);
  Outline outline;
  add_arc(outline, kRadius, half, 2 * kPi - half, 160);
  add_arc(outline, kRadius - 3, -half, half, 1);  // radial walls, so that the centre sees them
  return prism(outline, 14);
}

/// A hexagon of 52 across its corners, 40 high, with a rib 3 mm wide and 2 mm high along one side.
inline Mesh hexagon_with_boss() {
  constexpr double kSide = 26 * 0.8660254037844386;  // from the centre to a side
  Outline outline;
  for (int k = 0; k < 6; ++k) {
    const double angle = (k - 0.5) * kPi / 3;
    outline.push_back(26 * Vec2(std::cos(angle), std::sin(angle)));
    if (k == 0) outline.insert(outline.end(), {{kSide, -1.5}, {kSide + 2, -1.6}, {kSide + 2, 1.6}, {kSide, 1.5}});
  }
  return prism(outline, 40);
}

struct NearSymmetric {
  const char* name;
  Mesh mesh;
  std::size_t symmetries;  ///< discrete ones, the identity included
};
inline std::vector<NearSymmetric> near_symmetric_parts() {
  return {{"plate_with_small_hole", plate_with_small_hole(), 1},
          {"bar_with_flat", bar_with_flat(), 2},
          {"block_with_chamfer", block_with_chamfer(), 2},
          {"disc_with_slot", disc_with_slot(), 2},
          {"hexagon_with_boss", hexagon_with_boss(), 2}};
}

}  // namespace tribin::test
