#include "tribin/cad/mend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/solids.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

/// Shuffles the triangles and turns each with a probability.
void scramble(Mesh& mesh, unsigned seed, double turned) {
  std::mt19937 random(seed);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  for (auto& t : mesh.triangles) {
    std::rotate(t.begin(), t.begin() + random() % 3, t.end());
    if (std::uniform_real_distribution<double>(0, 1)(random) < turned) std::swap(t[1], t[2]);
  }
}

TEST(MendMesh, TurnsEachShellOutwardHoweverItWasWound) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    test::add_box(mesh, {0, 0, 0}, {10, 20, 30});
    test::add_box(mesh, {2, 2, 2}, {5, 6, 7});      // a cavity
    test::add_box(mesh, {40, 0, 0}, {50, 10, 10});  // a second body
    test::add_box(mesh, {3, 3, 3}, {4, 4, 4});      // a ball in the cavity
    scramble(mesh, seed, 0.1 * (seed % 11));
    const MendReport report = mend_mesh(mesh);
    EXPECT_EQ(mesh.vertices.size(), 32u);
    EXPECT_EQ(mesh.triangles.size(), 48u);
    EXPECT_EQ(report.shells, 4);
    EXPECT_TRUE(mesh.oriented);
    EXPECT_NEAR(signed_volume(mesh), 6000 - 60 + 1000 + 1, 0.01);
    EXPECT_NEAR(surface_area(mesh), 2200 + 94 + 600 + 6, 0.01);
  }
}

TEST(MendMesh, SolidsThatTouchStaySolid) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    test::add_box(mesh, {0, 0, 0}, {10, 10, 10});
    test::add_box(mesh, {10, 1, 1}, {20, 9, 9});  // face to face
    scramble(mesh, seed, 0.5);
    mend_mesh(mesh);
    EXPECT_TRUE(mesh.oriented);
    EXPECT_NEAR(signed_volume(mesh), 1000 + 640, 0.01);
  }
}

TEST(MendMesh, TellsTheOutsideOfAnOpenBoxButNotOfAPlate) {
  Mesh box;
  test::add_box(box, {0, 0, 0}, {10, 10, 10});
  box.triangles.resize(10);  // one face is missing
  scramble(box, 3, 0.5);
  const MendReport report = mend_mesh(box);
  EXPECT_EQ(report.boundary_edges, 4u);
  EXPECT_TRUE(box.oriented);
  const Vec3 center(5, 5, 5);
  for (const auto& t : box.triangles) {
    const Vec3 a = box.vertices[t[0]].cast<double>(), b = box.vertices[t[1]].cast<double>(),
               c = box.vertices[t[2]].cast<double>();
    EXPECT_GT((b - a).cross(c - a).dot(a - center), 0);
  }
  Mesh plate;
  test::add_box(plate, {0, 0, 0}, {10, 10, 10});
  plate.triangles.resize(2);
  mend_mesh(plate);
  EXPECT_FALSE(plate.oriented);
  EXPECT_FALSE(plate.warnings.empty());
}

TEST(MendMesh, DropsWhatIsNoSurfaceAndKeepsFacesInStep) {
  Mesh mesh;
  test::add_box(mesh, {0, 0, 0}, {10, 10, 10});
  for (std::size_t i = 0; i < 12; ++i) mesh.face_of_triangle.push_back(static_cast<int>(i) + 1);
  mesh.triangles.insert(mesh.triangles.begin() + 3, {mesh.triangles[0], {0, 0, 1}, {0, 1, 1}});
  mesh.face_of_triangle.insert(mesh.face_of_triangle.begin() + 3, {99, 99, 99});
  const MendReport report = mend_mesh(mesh);
  EXPECT_EQ(report.degenerate, 2u);
  EXPECT_EQ(report.duplicate, 1u);
  ASSERT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(std::count(mesh.face_of_triangle.begin(), mesh.face_of_triangle.end(), 99), 0);
  EXPECT_EQ(mesh.face_of_triangle.size(), 12u);
}

TEST(MendMesh, RefusesWhatIsNoMesh) {
  Mesh mesh;
  test::add_box(mesh, {0, 0, 0}, {1, 1, 1});
  Mesh bad = mesh;
  bad.vertices[3].x() = NAN;
  EXPECT_THROW(mend_mesh(bad), Error);
  bad = mesh;
  bad.triangles[2][1] = 1000;
  EXPECT_THROW(mend_mesh(bad), Error);
  bad = Mesh{};
  EXPECT_THROW(mend_mesh(bad), Error);
}

TEST(WeldVertices, JoinsWithinTheToleranceAndNotBeyond) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-100, 100), close(-0.4f, 0.4f);
  Mesh mesh;
  for (int i = 0; i < 3000; ++i) mesh.vertices.emplace_back(place(random), place(random), place(random));
  for (std::uint32_t i = 0; i + 2 < 3000; i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
  const Mesh original = mesh;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    mesh.vertices.push_back(original.vertices[i] + 1e-3f * Vec3f(close(random), close(random), close(random)));
  }
  for (const auto& t : original.triangles) mesh.triangles.push_back({t[0] + 3000, t[1] + 3000, t[2] + 3000});
  EXPECT_EQ(weld_vertices(mesh, 1e-3), 3000u);
  EXPECT_EQ(mesh.vertices.size(), 3000u);
}

TEST(Diameter, IsTheFarthestPair) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    std::vector<Vec3f> points;
    for (int i = 0; i < 60; ++i) points.emplace_back(3 * normal(random), normal(random), 0.2f * normal(random));
    double truth = 0;
    for (const Vec3f& a : points) {
      for (const Vec3f& b : points) truth = std::max(truth, (a.cast<double>() - b.cast<double>()).norm());
    }
    EXPECT_NEAR(diameter(points), truth, 1e-12);
  }
}

}  // namespace
}  // namespace tribin
