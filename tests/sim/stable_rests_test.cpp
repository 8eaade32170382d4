#include "tribin/sim/stable_rests.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tribin/io/cad_files.hpp"
#include "tribin/sim/table_scene.hpp"

namespace tribin::sim {
namespace {

Mesh box_mesh(float x, float y, float z) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.push_back({i & 1 ? x : 0, i & 2 ? y : 0, i & 4 ? z : 0});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  mesh.name = "box";
  return mesh;
}

/// What holds for every rest: nothing below the table, something on it, the centre of mass above the origin.
void expect_lies_still(const Mesh& mesh, const std::vector<StableRest>& rests) {
  double sum = 0;
  for (const StableRest& rest : rests) {
    double lowest = 1e300;
    for (const Vec3f& v : mesh.vertices) lowest = std::min(lowest, (rest.table_from_part * Vec3(v.cast<double>())).z());
    EXPECT_NEAR(lowest, 0, 1e-3);
    const Vec3 centre = rest.table_from_part * centre_of_mass(mesh);
    EXPECT_NEAR(std::hypot(centre.x(), centre.y()), 0, 1e-6);
    EXPECT_GT(centre.z(), 0);
    EXPECT_GT(rest.margin_mm, 0);
    EXPECT_NEAR(rest.table_from_part.linear().determinant(), 1, 1e-9);
    sum += rest.probability;
  }
  EXPECT_NEAR(sum, 1, 1e-9);
}

TEST(StableRests, ABoxHasSixAndLikesItsLargestFace) {
  const Mesh box = box_mesh(60, 40, 20);
  const auto rests = stable_rests(box);
  ASSERT_EQ(rests.size(), 6u);
  expect_lies_still(box, rests);
  EXPECT_NEAR(std::abs(rests[0].table_from_part.linear()(2, 2)), 1, 1e-9);
  EXPECT_NEAR(rests[0].margin_mm, 20, 1e-6);
  EXPECT_NEAR(rests[0].probability, rests[1].probability, 1e-9);
  // A cube: the solid angles of its faces are equal.
  for (const StableRest& r : stable_rests(box_mesh(30, 30, 30))) EXPECT_NEAR(r.probability, 1.0 / 6, 1e-9);
}

TEST(StableRests, TheAlternatorsLieAsTheyShould) {
  for (const std::string part : {"alternator_a", "alternator_b"}) {
    const Mesh mesh = read_cad(std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/parts" / (part + ".stl"));
    const auto rests = stable_rests(mesh);
    SCOPED_TRACE(part);
    expect_lies_still(mesh, rests);
    EXPECT_GE(rests.size(), 6u);
    EXPECT_LE(rests.size(), 40u);
  }
}

TEST(LayOnTable, NothingOverlaps) {
  const Mesh box = box_mesh(60, 40, 20);
  const auto rests = stable_rests(box);
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    const Layout layout = lay_on_table(std::vector<TablePart>(12, {&box, &rests}), 200, 160, seed);
    EXPECT_GE(layout.laid.size(), 3u);
    const Vec3 c = centre_of_mass(box);
    for (std::size_t i = 0; i < layout.laid.size(); ++i) {
      for (const Vec3f& v : box.vertices) {
        const Vec3 p = layout.table_from_part[i] * Vec3(v.cast<double>());
        EXPECT_TRUE(std::abs(p.x()) <= 200.001 && std::abs(p.y()) <= 160.001 && p.z() > -1e-6);
      }
      for (std::size_t k = 0; k < i; ++k)  // 20 mm: half the least side seen from above in any rest
        EXPECT_GT((layout.table_from_part[i] * c - layout.table_from_part[k] * c).head<2>().norm(), 20);
    }
  }
}

}  // namespace
}  // namespace tribin::sim
