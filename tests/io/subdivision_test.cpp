#include "io/subdivision.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tribin::io {
namespace {

SubdivisionCage cube() {
  SubdivisionCage cage;
  for (int i = 0; i < 8; ++i) cage.points.push_back(Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  cage.faces = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return cage;
}

TEST(Subdivide, GivesThePointsOfCatmullAndClark) {
  const SubdivisionCage next = subdivide(cube());
  EXPECT_EQ(next.faces.size(), 24u);
  EXPECT_EQ(next.points.size(), 8u + 6u + 12u);
  EXPECT_LT((next.points[7] - Vec3::Constant(5.0 / 9)).norm(), 1e-12);  // (face mean + 2 edge mean) / 3
  int edge_points = 0;
  for (const Vec3& p : next.points) edge_points += std::abs(p.cwiseAbs().maxCoeff() - 0.75) < 1e-12;
  EXPECT_EQ(edge_points, 12);
}

TEST(Subdivide, KeepsWhatIsSharp) {
  SubdivisionCage cage = cube();
  for (std::uint32_t a = 0; a < 8; ++a)
    for (std::uint32_t bit : {1u, 2u, 4u})
      if (!(a & bit)) cage.creases.push_back({{a | bit, a}, 2});
  for (int level = 0; level < 3; ++level) {
    cage = subdivide(cage);
    double size = 0;
    for (const Vec3& p : cage.points) size = std::max(size, p.cwiseAbs().maxCoeff());
    EXPECT_DOUBLE_EQ(size, 1) << "the middles of the faces";
    EXPECT_EQ((cage.points[7] - Vec3::Ones()).norm() < 1e-12, level < 2) << "two steps sharp, then smooth";
  }
}

TEST(Subdivide, TheRimOfAnOpenMeshIsACurveOfItsOwn) {
  SubdivisionCage plate;
  plate.points = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}};
  plate.faces = {{0, 1, 2, 3}};
  const SubdivisionCage next = subdivide(plate);
  EXPECT_LT((next.points[0] - Vec3(0.5, 0.5, 0)).norm(), 1e-12);  // (6 p + both neighbours) / 8
}

}  // namespace
}  // namespace tribin::io
