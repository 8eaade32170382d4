#include <gtest/gtest.h>

#include "grasp_scene.hpp"

namespace tribin::grasp {
namespace {

using test::here;
using test::in_bin;
using test::Known;
using test::on_floor;
using test::rod;

TEST(PlanPushes, LeadFromTheWallToTheMiddle) {
  // Too near to a wall for a finger behind it, and along it.
  for (const double side : {-1.0, 1.0}) {
    SCOPED_TRACE(side);
    Scene scene = in_bin();
    scene.parts = {here(rod(), on_floor(rod().part, side * 134, 0))};
    const PushPlan plan = plan_pushes(scene);
    ASSERT_FALSE(plan.pushes.empty());
    double last = 1;
    for (const Push& push : plan.pushes) {
      EXPECT_LE(push.score, last);
      last = push.score;
      ASSERT_EQ(push.path.size(), 4u);
      const Vec3 from = push.path[1].base_from_tcp.translation(), to = push.path[2].base_from_tcp.translation();
      EXPECT_EQ(push.path[2].step, Step::push);
      EXPECT_NEAR((to - from).z(), 0, 1e-9);
      EXPECT_GE((to - from).norm(), push.length_mm);
      // Never against the wall that it stands at.
      EXPECT_LE(side * (to - from).x(), 3);
      double product = 1;
      for (const Term& term : push.terms) product *= term.value;
      EXPECT_NEAR(push.score, product, 1e-12);
    }
  }
}

TEST(PlanPushes, NothingOfTheToolTouchesWallsAndItComesDownFree) {
  const Vec3 corners[] = {Vec3(125, 95, 0), Vec3(-125, 95, 0), Vec3(100, 0, 0), Vec3(0, 0, 0), Vec3(-120, -60, 0)};
  int pushes = 0;
  for (const Vec3& place : corners) {
    Scene scene = in_bin();
    scene.parts = {here(rod(), on_floor(rod().part, place.x(), place.y()))};
    const Scan scan = test::seen(scene);
    scene.scan = &scan;
    const GripperShape& shape = rod().grasps.grippers[0];
    std::vector<Vec3> points = test::surface_points(rod().part.mesh, 5);
    for (Vec3& p : points) p = scene.parts[0].base_from_part * p;
    for (const Push& push : plan_pushes(scene).pushes) {
      ++pushes;
      for (std::size_t i = 0; i < push.path.size(); ++i)
        for (const Convex& piece : pieces_at(shape, shape.stroke_min())) {
          const Convex body = moved(push.path[i].base_from_tcp, piece);
          EXPECT_GT(-reach_along(body, -Vec3::UnitZ()), 0);
          if (-reach_along(body, -Vec3::UnitZ()) < 100) {
            EXPECT_LT(reach_along(body, Vec3::UnitX()), 150);
            EXPECT_LT(reach_along(body, -Vec3::UnitX()), 150);
            EXPECT_LT(reach_along(body, Vec3::UnitY()), 120);
            EXPECT_LT(reach_along(body, -Vec3::UnitY()), 120);
          }
          const auto within = [&](const Vec3& p) { return test::holds(body, p); };
          EXPECT_TRUE(i >= 2 || std::none_of(points.begin(), points.end(), within));
        }
      // It does touch the part on its way.
      int touched = 0;
      for (int k = 4; k <= 8; ++k) {
        Pose pose = push.path[1].base_from_tcp;
        pose.translation() += k / 8.0 * (push.path[2].base_from_tcp.translation() - pose.translation());
        for (const Convex& piece : pieces_at(shape, shape.stroke_min()))
          for (const Vec3& p : points) touched += test::holds(moved(pose, piece), p);
      }
      EXPECT_GT(touched, 0);
    }
  }
  EXPECT_GT(pushes, 20);
}

TEST(PlanPushes, RefusalsAreCounted) {
  Scene scene = in_bin();
  scene.bin->inner_size_mm = Vec3(30, 62, 100);  // as narrow as the part
  scene.parts = {here(rod(), on_floor(rod().part, 0, 0, Vec3(kPi / 2, 0, 0)))};
  const PushPlan plan = plan_pushes(scene);
  EXPECT_TRUE(plan.pushes.empty());
  int counted = 0;
  for (const WhyCount& count : plan.reasons) counted += count.count;
  EXPECT_EQ(counted, static_cast<int>(plan.refused.size()));
  EXPECT_GT(counted, 0);
}

}  // namespace
}  // namespace tribin::grasp
