#include <gtest/gtest.h>

#include <cmath>

#include "tribin/model/primitive_model.hpp"

namespace tribin {
namespace {

/// A tube of n facets: outer radius R, bore r, height h, closed by two rings. Triangles run counter-clockwise from
/// outside.
Mesh tube(double outer, double bore, double height, int facets) {
  Mesh mesh;
  mesh.name = "tube";
  for (int i = 0; i < facets; ++i) {
    const double a = 2 * kPi * i / facets;
    for (double r : {outer, bore})
      for (double z : {0.0, height}) mesh.vertices.push_back(Vec3(r * std::cos(a), r * std::sin(a), z).cast<float>());
  }
  const auto at = [&](int i, int ring, int top) {
    return static_cast<std::uint32_t>((i % facets) * 4 + ring * 2 + top);
  };
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (int i = 0; i < facets; ++i) {
    quad(at(i, 0, 0), at(i + 1, 0, 0), at(i + 1, 0, 1), at(i, 0, 1));
    quad(at(i + 1, 1, 0), at(i, 1, 0), at(i, 1, 1), at(i + 1, 1, 1));
    quad(at(i, 0, 1), at(i + 1, 0, 1), at(i + 1, 1, 1), at(i, 1, 1));
    quad(at(i + 1, 0, 0), at(i, 0, 0), at(i, 1, 0), at(i + 1, 1, 0));
  }
  return mesh;
}

TEST(SegmentCad, RadiiOfATubeAreExact) {
  for (int facets : {12, 24, 48, 200}) {
    SCOPED_TRACE(facets);
    const Mesh mesh = tube(20, 8, 30, facets);
    const Surfels surfels = surfels_from_mesh(mesh);
    const Primitives found = segment(surfels);
    int planes = 0, convex = 0, concave = 0;
    for (const Primitive& p : found.items) {
      if (p.type == PrimitiveType::plane) {
        ++planes;
        EXPECT_NEAR(p.offset_mm, p.axis.z() > 0 ? 30 : 0, 1e-3);  // outward normals
      }
      if (p.type != PrimitiveType::cylinder) continue;
      (p.concave ? concave : convex) += 1;
      EXPECT_NEAR(p.radius_mm, p.concave ? 8 : 20, 0.01);
      EXPECT_NEAR(p.height_mm(), 30, 1e-3);
      EXPECT_NEAR(p.arc, 2 * kPi, 1e-6);
    }
    EXPECT_EQ(planes, 2);
    EXPECT_EQ(convex, 1);
    EXPECT_EQ(concave, 1);
    EXPECT_EQ(found.items.size(), 4u);
  }
}

TEST(BuildModel, TheTubesRelations) {
  const Mesh mesh = tube(20, 8, 30, 48);
  const Surfels surfels = surfels_from_mesh(mesh);
  const PrimitiveModel model = build_model(segment(surfels), surfels);
  int coaxial = 0, parallel_planes = 0, axis_meets_plane = 0;
  for (const Relation& r : model.relations) {
    if (r.type == RelationType::cylinder_cylinder) coaxial += r.coaxial && !r.adjacent;
    if (r.type == RelationType::plane_plane) {
      parallel_planes += r.angle < 1e-6 && std::abs(r.distance_mm - 30) < 1e-3;
    }
    if (r.type == RelationType::plane_cylinder) axis_meets_plane += r.adjacent && r.line_point.head<2>().norm() < 1e-3;
  }
  EXPECT_EQ(coaxial, 1);
  EXPECT_EQ(parallel_planes, 1);
  EXPECT_EQ(axis_meets_plane, 4);
}

TEST(SegmentCad, ExactFacesWin) {
  Mesh mesh = tube(20, 8, 30, 24);
  mesh.faces = {{.id = 1, .type = SurfaceType::cylinder, .axis = Vec3::UnitZ(), .radius_mm = 20},
                {.id = 2, .type = SurfaceType::cylinder, .axis = Vec3::UnitZ(), .radius_mm = 20},
                {.id = 3, .type = SurfaceType::free_form}};
  // The outer wall is split into two faces of one surface. The rest is said to be free form: what is none was named
  // when the file was read (recognize_surface), and primitives cut out of a thread or a loft would be invented.
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    mesh.face_of_triangle.push_back(t % 8 < 2 ? (t < mesh.triangles.size() / 2 ? 1 : 2) : 3);
  const Surfels surfels = surfels_from_mesh(mesh);
  const Primitives found = segment(surfels);
  int outer = 0;
  for (const Primitive& p : found.items) outer += p.type == PrimitiveType::cylinder && !p.concave && p.radius_mm == 20;
  EXPECT_EQ(outer, 1);
  EXPECT_EQ(found.items.size(), 1u);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    EXPECT_EQ(found.label_of_surfel[t] > 0, mesh.face_of_triangle[t] != 3);
}

}  // namespace
}  // namespace tribin
