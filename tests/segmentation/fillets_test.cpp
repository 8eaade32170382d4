#include <gtest/gtest.h>

#include <map>

#include "tribin/cad/mesh.hpp"
#include "tribin/segmentation/primitives.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {
namespace {

/// What an outline (x, z), convex enough for a fan from its first point, makes from y = 0 to `length_mm`.
Mesh prism(const std::vector<Vec2>& outline, double length_mm, double chord_error_mm) {
  Mesh mesh;
  for (const double y : {0.0, length_mm})
    for (const Vec2& p : outline) mesh.vertices.push_back(Vec3f(float(p.x()), float(y), float(p.y())));
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, i + n, j});
    mesh.triangles.push_back({j, i + n, j + n});
    if (i > 0 && i + 1 < n) {
      mesh.triangles.push_back({0, i, i + 1});
      mesh.triangles.push_back({n, n + i + 1, n + i});
    }
  }
  mesh.oriented = true;
  mesh.chord_error_mm = chord_error_mm;
  return mesh;
}

/// A bar along y whose outline (x, z) is a rectangle of 40 x 30 mm; one corner is rounded with radius 8, one is cut
/// off at 45 deg.
Mesh bar(int facets) {
  std::vector<Vec2> outline = {{0, 0}, {40, 0}, {40, 22}};
  for (int k = 0; k <= facets; ++k) {
    const double a = 0.5 * kPi * k / facets;
    outline.push_back({32 + 8 * std::cos(a), 22 + 8 * std::sin(a)});
  }
  outline.erase(outline.begin() + 2);  // the arc's first point stands there
  outline.push_back({8, 30});
  outline.push_back({0, 22});
  return prism(outline, 60, 8 * (1 - std::cos(0.25 * kPi / facets)));
}

TEST(Fillets, ARoundedEdgeIsOneAndAChamferIsNot) {
  for (const int facets : {6, 12, 24}) {
    SCOPED_TRACE(facets);
    const Primitives found = segment(surfels_from_mesh(bar(facets)));
    int fillets = 0;
    for (const Primitive& p : found.items) {
      if (!p.fillet) continue;
      ++fillets;
      EXPECT_EQ(p.type, PrimitiveType::cylinder);
      EXPECT_NEAR(p.radius_mm, 8, 0.01);
    }
    EXPECT_EQ(fillets, 1);
  }
}

TEST(Fillets, AShaftIsNone) {
  // A quarter of a tube: its flat sides meet it at right angles.
  constexpr int kFacets = 16;
  std::vector<Vec2> outline = {{0, 0}};
  for (int k = 0; k <= kFacets; ++k) {
    const double a = 0.5 * kPi * k / kFacets;
    outline.push_back({20 * std::cos(a), 20 * std::sin(a)});
  }
  const Mesh mesh = prism(outline, 40, 20 * (1 - std::cos(0.25 * kPi / kFacets)));
  const Primitives found = segment(surfels_from_mesh(mesh));
  int cylinders = 0;
  for (const Primitive& p : found.items) {
    EXPECT_FALSE(p.fillet);
    cylinders += p.type == PrimitiveType::cylinder;
  }
  EXPECT_EQ(cylinders, 1);
}

}  // namespace
}  // namespace tribin
