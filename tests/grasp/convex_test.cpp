#include "tribin/grasp/convex.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tribin::grasp {
namespace {

Pose random_pose(std::mt19937& random, double reach) {
  std::uniform_real_distribution<double> number(-1, 1);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(kPi * Vec3(number(random), number(random), number(random)));
  pose.translation() = reach * Vec3(number(random), number(random), number(random));
  return pose;
}

/// A body of any kind.
Convex random_body(std::mt19937& random) {
  std::uniform_real_distribution<double> number(0, 1);
  Convex body;
  body.frame_from_body = random_pose(random, 100);
  const int kind = static_cast<int>(4 * number(random));
  if (kind != 3) body.half_mm = 30 * Vec3(number(random), number(random), number(random));
  if (kind == 1) body.half_mm.head<2>().setZero(), body.disc_mm = 20 * number(random);
  if (kind >= 2) body.radius_mm = 15 * number(random);
  if (number(random) < 0.5) body.sweep_mm = 50 * Vec3(number(random), number(random), number(random));
  return body;
}

/// A gap is right when planes square to one direction part the bodies by it, and no direction parts them by more.
TEST(Convex, GapIsTheWidestSlabBetweenBodies) {
  std::mt19937 random(7);
  int apart = 0;
  for (int i = 0; i < 500; ++i) {
    SCOPED_TRACE(i);
    const Convex a = random_body(random), b = random_body(random);
    const double gap = distance_mm(a, b);
    EXPECT_NEAR(gap, distance_mm(b, a), 1e-6);
    // The slab along any direction is no wider than the gap; the best of many, made better step by step, is as wide.
    double widest = -1e300;
    Vec3 best = Vec3::UnitZ();
    const auto slab = [&](const Vec3& d) { return -reach_along(a, d) - reach_along(b, -d); };
    std::normal_distribution<double> normal;
    for (double spread = 1; spread > 1e-6; spread *= 0.7)
      for (int k = 0; k < 60; ++k) {
        const Vec3 d = (best + spread * Vec3(normal(random), normal(random), normal(random))).normalized();
        const double w = slab(d);
        EXPECT_LE(w, gap + 1e-6);
        if (w > widest) widest = w, best = d;
      }
    if (gap > 0) {
      ++apart;
      EXPECT_NEAR(widest, gap, 1e-2 + 1e-3 * gap);
    } else {
      EXPECT_LE(widest, 1e-6);
    }
  }
  EXPECT_GT(apart, 200);
}

TEST(Convex, EnoughIsALowerBound) {
  std::mt19937 random(8);
  for (int i = 0; i < 300; ++i) {
    const Convex a = random_body(random), b = random_body(random);
    const double gap = distance_mm(a, b), bound = distance_mm(a, b, 5);
    EXPECT_LE(bound, gap + 1e-6);
    EXPECT_GE(bound, std::min(gap, 5.0) - 1e-6);
  }
}

TEST(Convex, RigidMotionChangesNoGap) {
  std::mt19937 random(9);
  for (int i = 0; i < 300; ++i) {
    const Convex a = random_body(random), b = random_body(random);
    const Pose move = random_pose(random, 1000);
    EXPECT_NEAR(distance_mm(moved(move, a), moved(move, b)), distance_mm(a, b), 1e-5);
  }
}

}  // namespace
}  // namespace tribin::grasp
