#include "recognition/contacts.hpp"

#include <gtest/gtest.h>

#include <random>

#include "recognition/keep_apart.hpp"
#include "support/posed_scan.hpp"
#include "support/solids.hpp"

namespace tribin {
namespace {

Solid box(const Vec3f& half) {
  Mesh mesh;
  test::add_box(mesh, -half, half);
  return {mesh.vertices, mesh.triangles};
}

/// A body with 11 x 11 points a face.
Body body(const Solid& solid, const Pose& pose, const Eigen::Matrix<double, 6, 1>& sigma) {
  Body out;
  out.solid = &solid;
  out.camera_from_body = pose;
  out.covariance = Matrix6(sigma.cwiseProduct(sigma).asDiagonal());
  out.tolerance_mm = 0.05;
  const Vec3f low = solid.low().cast<float>(), high = solid.high().cast<float>();
  constexpr int kSteps = 10;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j)
        for (int side = 0; side <= kSteps; side += kSteps) {
          Vec3f at, normal = Vec3f::Zero();
          at[axis] = static_cast<float>(side), at[(axis + 1) % 3] = static_cast<float>(i);
          at[(axis + 2) % 3] = static_cast<float>(j);
          normal[axis] = side > 0 ? 1.0f : -1.0f;
          out.points.push_back(low + (high - low).cwiseProduct(at / kSteps));
          out.normals.push_back(normal);
        }
  return out;
}

Pose at(double x, double y, double z) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

Eigen::Matrix<double, 6, 1> sigmas(double x) {
  Eigen::Matrix<double, 6, 1> out;
  out << x, 0.02, 0.02, 0.0005, 0.0005, 0.0005;
  return out;
}

TEST(Solid, TellsHowDeepAPointLies) {
  const Solid solid = box(Vec3f(20, 10, 5));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 p(20 * place(random), 10 * place(random), 5 * place(random));
    const auto depth = solid.depth(p, -Vec3::UnitX());
    ASSERT_EQ(depth.has_value(), ((Vec3(20, 10, 5) - p.cwiseAbs()).array() > 0).all());
    if (!depth) continue;
    EXPECT_NEAR(depth->mm, 20 - p.x(), 1e-9);
    EXPECT_NEAR((depth->outward - Vec3::UnitX()).norm(), 0, 1e-9);
  }
}

TEST(Separate, TheOneWithTheWeakDirectionSlides) {
  const Solid solid = box(Vec3f(20, 10, 5));
  // 1.5 mm in each other along x; the second one is free to slide by some millimetres along x.
  std::vector<Body> bodies = {body(solid, at(0, 0, 500), sigmas(0.02)), body(solid, at(38.5, 1, 501), sigmas(2))};
  bodies[1].covariance(0, 0) = 1;
  bodies[0].tolerance_mm = bodies[1].tolerance_mm = 0;
  bodies[1].covariance = Matrix6(Eigen::Matrix<double, 6, 6>(bodies[1].covariance) * 0.2);
  const std::vector<Overlap> overlap = overlaps(bodies);
  ASSERT_EQ(overlap.size(), 1u);
  EXPECT_NEAR(overlap[0].depth_mm, 1.5, 1e-6);
  separate(bodies, overlap);
  EXPECT_TRUE(overlaps(bodies).empty());
  EXPECT_NEAR(bodies[0].camera_from_body.translation().x(), 0, 0.01);
  EXPECT_NEAR(bodies[1].camera_from_body.translation().x(), 40, 0.02);
}

TEST(Separate, NoPairIsDeeperThanBeforeAndWhatTouchesNothingStays) {
  const Solid solid = box(Vec3f(20, 10, 5));
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int overlapped = 0, resolved = 0;
  for (int round = 0; round < 40; ++round) {
    SCOPED_TRACE(round);
    std::vector<Body> bodies;
    for (int k = 0; k < 4; ++k) {
      Vector6 off;
      for (int i = 0; i < 6; ++i) off[i] = normal(random) * (i < 3 ? 0.5 : 0.02);
      bodies.push_back(body(solid, moved(at(40.0 * k, 0, 500), off), sigmas(0.1)));
    }
    bodies.push_back(body(solid, at(0, 200, 500), sigmas(0.1)));
    const std::vector<Overlap> before = overlaps(bodies);
    const std::vector<Body> old = bodies;
    separate(bodies, before);
    const std::vector<Overlap> after = overlaps(bodies);
    overlapped += static_cast<int>(before.size());
    resolved += static_cast<int>(before.size() - after.size());
    for (const Overlap& o : after) {
      const auto same =
          std::find_if(before.begin(), before.end(), [&](const Overlap& b) { return b.a == o.a && b.b == o.b; });
      if (same != before.end()) {
        EXPECT_LE(o.depth_mm, same->depth_mm + 2e-3);
      }
    }
    EXPECT_EQ((bodies[4].camera_from_body.matrix() - old[4].camera_from_body.matrix()).norm(), 0);
    if (before.empty()) {
      for (std::size_t i = 0; i < bodies.size(); ++i)
        EXPECT_EQ((bodies[i].camera_from_body.matrix() - old[i].camera_from_body.matrix()).norm(), 0);
    }
  }
  EXPECT_GT(overlapped, 0);
  EXPECT_GE(resolved, overlapped / 2);
}

TEST(Separate, WhatCannotMoveStays) {
  const Solid solid = box(Vec3f(20, 10, 5));
  std::vector<Body> bodies = {body(solid, at(0, 0, 500), sigmas(0)), body(solid, at(30, 1, 501), sigmas(0))};
  for (Body& b : bodies) b.covariance = Matrix6::Zero();
  const std::vector<Overlap> overlap = overlaps(bodies);
  ASSERT_EQ(overlap.size(), 1u);
  separate(bodies, overlap);
  EXPECT_EQ(overlaps(bodies).size(), 1u);
  EXPECT_EQ(bodies[1].camera_from_body.translation().x(), 30);
}

/// Two blocks side by side on a table, and answers of which the second one is too near by so much.
struct TwoBlocks {
  Mesh mesh;
  std::vector<Part> parts;
  Scan scan;
  Surfels surfels;
  SceneDepth scene;
  std::vector<Instance> items;

  explicit TwoBlocks(double too_near_mm) {
    test::add_box(mesh, Vec3f(-20, -12, -8), Vec3f(20, 12, 8));
    mesh.oriented = true;
    parts = {compile_part(mesh)};
    parts[0].name = "block";
    const std::array<Pose, 2> truth = {at(-20.2, 0, 600), at(20.2, 0, 600)};
    scan = test::posed_scan({{&mesh, truth[0]}, {&mesh, truth[1]}}, Vec3(0, 0, -1), -608, 0.05, 0.5, 1);
    surfels = surfels_from_scan(scan);
    scene = make_scene_depth(scan, surfels);
    for (std::size_t k = 0; k < 2; ++k) {
      Instance instance;
      instance.part = "block";
      instance.score = 0.99 - 0.01 * static_cast<double>(k);
      instance.camera_from_part = truth[k];
      Eigen::Matrix<double, 6, 1> sigma;
      sigma << (k == 0 ? 0.02 : 0.3), 0.02, 0.02, 0.0003, 0.0003, 0.0003;
      instance.covariance = Matrix6(sigma.cwiseProduct(sigma).asDiagonal());
      items.push_back(instance);
    }
    items[1].camera_from_part.translation().x() -= too_near_mm;
  }
};

TEST(KeepApart, WhatStandsInAnotherMovesOutOfIt) {
  for (const double too_near_mm : {2.5, 3.0}) {
    TwoBlocks blocks(too_near_mm);
    std::vector<Reason> rejected;
    keep_apart(blocks.parts, blocks.scene, nullptr, blocks.items, rejected);
    ASSERT_EQ(blocks.items.size(), 2u);
    EXPECT_TRUE(rejected.empty());
    // As near as they may be: what is left of the error is the gap between them.
    EXPECT_NEAR(blocks.items[1].camera_from_part.translation().x(), 20.2, 0.45);
    EXPECT_NEAR(blocks.items[0].camera_from_part.translation().x(), -20.2, 0.02);
  }
}

TEST(KeepApart, WhatIsApartStaysToTheBit) {
  TwoBlocks blocks(0.2);
  const std::vector<Instance> before = blocks.items;
  std::vector<Reason> rejected;
  keep_apart(blocks.parts, blocks.scene, nullptr, blocks.items, rejected);
  ASSERT_EQ(blocks.items.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_EQ(blocks.items[k].camera_from_part.matrix(), before[k].camera_from_part.matrix());
}

TEST(KeepApart, OfTwoThatStayInEachOtherTheLessSureIsTakenOut) {
  TwoBlocks blocks(12);
  for (Instance& instance : blocks.items) instance.covariance = Matrix6(1e-4 * Matrix6::Identity());
  std::vector<Reason> rejected;
  // Apart they would lie where the scan shows neither.
  blocks.items[1].camera_from_part.translation().y() += 3;
  keep_apart(blocks.parts, blocks.scene, nullptr, blocks.items, rejected);
  ASSERT_EQ(blocks.items.size(), 1u);
  EXPECT_NEAR(blocks.items[0].camera_from_part.translation().x(), -20.2, 1e-12);
  ASSERT_EQ(rejected.size(), 1u);
  EXPECT_EQ(rejected[0].test, "penetration");
  EXPECT_GT(rejected[0].value, rejected[0].limit);
}

TEST(KeepApart, TheFloorOfTheBinIsABodyToo) {
  TwoBlocks blocks(0);
  BinSighting bin;
  bin.found = true;
  bin.shape.inner_size_mm = Vec3(200, 150, 80);
  bin.tolerance_mm = 0.1;
  // Seen from above: its z looks at the camera, its floor 3 mm above the blocks' lower faces.
  bin.camera_from_bin = at(0, 0, 605);
  bin.camera_from_bin.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  std::vector<Reason> rejected;
  keep_apart(blocks.parts, blocks.scene, &bin, blocks.items, rejected);
  EXPECT_TRUE(blocks.items.empty());
  ASSERT_FALSE(rejected.empty());
  EXPECT_EQ(rejected[0].test, "penetration");
}

}  // namespace
}  // namespace tribin
