#include "grasp/mesh_tree.hpp"

#include <gtest/gtest.h>

#include "grasp/depth_space.hpp"
#include "grasp_scene.hpp"

namespace tribin::grasp {
namespace {

using test::at;

TEST(MeshTree, FirstHitsAndGapsAreThoseOfTheShape) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const Vec3 size(20 + 10 * number(random), 30 + 10 * number(random), 40 + 10 * number(random));
    const MeshTree tree(test::box_mesh(size));
    // The box as a body: gaps to its mesh are gaps to it, from outside.
    const Convex box = make_box(at(size.x() / 2, size.y() / 2, size.z() / 2), size);
    Convex ball = make_capsule(Vec3(80 * number(random), 80 * number(random), 80 * number(random)),
                               Vec3(80 * number(random), 80 * number(random), 80 * number(random)), 5);
    ball.sweep_mm = Vec3(20 * number(random), 0, 0);
    const double gap = distance_mm(ball, box);
    if (gap > 0) {
      EXPECT_NEAR(tree.gap_mm(ball, 1e9), gap, 1e-4);
    }
    // Rays at the middle, seen from outside.
    const Vec3 from = size / 2 + 200 * Vec3(number(random), number(random), number(random)).normalized();
    const Vec3 towards = (size / 2 - from).normalized();
    const auto hit = tree.first_hit(from, towards, 1000);
    ASSERT_TRUE(hit);
    const Vec3 there = from + hit->t * towards;
    EXPECT_NEAR(((there - size / 2).cwiseAbs() - size / 2).maxCoeff(), 0, 1e-4);
    EXPECT_LT(tree.normal(hit->triangle).dot(towards), 0);
    EXPECT_TRUE(tree.inside(size / 2));
    EXPECT_FALSE(tree.inside(from));
  }
}

Scene above_floor() {
  Scene scene;
  scene.base_from_camera = test::camera_above();
  return scene;
}

TEST(DepthSpace, AllBehindASurfaceIsOccupied) {
  const Scene scene = above_floor();
  const Scan scan = test::seen(scene);
  const DepthSpace space(scan, scene.base_from_camera);
  const auto ball = [](double x, double y, double z) { return make_capsule(Vec3(x, y, z), Vec3(x, y, z), 5); };
  for (const double x : {-150.0, 0.0, 120.0}) {
    EXPECT_NEAR(space.gap_mm(ball(x, 30, 50), 100), 45, 0.5);
    EXPECT_EQ(space.gap_mm(ball(x, 30, -40), 100), 0);
    EXPECT_EQ(space.gap_mm(ball(x, 30, 3), 100), 0);
  }
}

TEST(DepthSpace, HolesAreAsNearAsTheirBorder) {
  const Scene scene = above_floor();
  const Mesh block = test::box_mesh(Vec3(80, 80, 60));
  Scan scan = test::seen(scene, {{&block, at(-40, -40, 0)}});
  // A dark spot across the block's edge: what is in it is unknown, and may be as high as the block.
  const Vec2 edge = scan.camera.project(scene.base_from_camera.inverse() * Vec3(60, 0, 0));
  for (int v = -12; v <= 12; ++v)
    for (int u = -12; u <= 12; ++u)
      scan.z_mm(static_cast<int>(edge.x()) + u, static_cast<int>(edge.y()) + v) = std::nanf("");
  const DepthSpace space(scan, scene.base_from_camera);
  EXPECT_EQ(space.gap_mm(make_capsule(Vec3(52, 0, 20), Vec3(52, 0, 20), 5), 10), 0);
  EXPECT_GT(space.gap_mm(make_capsule(Vec3(120, 0, 20), Vec3(120, 0, 20), 5), 10), 5);
}

TEST(DepthSpace, WithoutAPartItsPlaceIsFreeDownToItsFarSide) {
  Scene scene = above_floor();
  const test::Known known(test::cylinder_mesh(15, 60));
  scene.parts = {test::here(known, test::on_floor(known.part, 40, 20, Vec3(0, kPi / 2, 0)))};
  const Scan scan = test::seen(scene);
  const DepthSpace space(scan, scene.base_from_camera);
  const Convex finger = make_capsule(Vec3(40, 20, 18), Vec3(40, 20, 60), 5);
  EXPECT_EQ(space.gap_mm(finger, 10), 0);
  const DepthSpace without = space.without(*known.grasps.tree, scene.parts[0].base_from_part);
  EXPECT_GT(without.gap_mm(finger, 10), 9);
  // Beside it nothing has changed, and below it the floor is still there.
  EXPECT_EQ(without.gap_mm(make_capsule(Vec3(120, 20, 3), Vec3(120, 20, 60), 5), 10), 0);
  EXPECT_LT(without.gap_mm(make_capsule(Vec3(40, 20, 4), Vec3(40, 20, 60), 5), 10), 1);
}

}  // namespace
}  // namespace tribin::grasp
