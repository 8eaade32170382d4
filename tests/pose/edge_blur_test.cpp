#include "tribin/pose/edge_blur.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/posed_scan.hpp"
#include "support/solids.hpp"
#include "tribin/pose/drawn_out.hpp"
#include "tribin/pose/refine.hpp"
#include "tribin/pose/verification.hpp"

namespace tribin {
namespace {

/// A block 80 x 60 x 40 mm.
Mesh block() {
  Mesh mesh;
  test::add_box(mesh, Vec3f(-40, -30, -20), Vec3f(40, 30, 20));
  return mesh;
}

/// Standing over a table, seen nearly from above and turned by the seed; 1.1 mm a pixel.
Pose over_table(unsigned seed) {
  Pose pose = Pose::Identity();
  pose.linear() = (Eigen::AngleAxisd(0.3 * seed, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(0.1 * std::sin(seed), Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(5 * std::cos(seed), 4 * std::sin(seed), 470);
  return pose;
}

constexpr double kFloor = -540;

Scan blurred_scan(const std::vector<std::pair<const Mesh*, Pose>>& things, double sd, unsigned seed) {
  Scan scan = test::posed_scan(things, Vec3(0, 0, -1), kFloor, 0, 0, seed, 320, 256);
  test::draw_steps_out(scan.z_mm, sd);
  const std::vector<double> noise = test::correlated_noise(scan.width(), scan.height(), 0.6, seed);
  for (std::size_t i = 0; i < scan.z_mm.size(); ++i) scan.z_mm.data[i] += static_cast<float>(0.3 * noise[i]);
  return scan;
}

TEST(EdgeBlur, IsTheWidthThatStepsAreDrawnWith) {
  const Mesh mesh = block();
  for (unsigned seed = 1; seed <= 10; ++seed)
    for (const double sd : {1.0, 2.0, 3.0}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", blur " << sd);
      const Scan scan = blurred_scan({{&mesh, over_table(seed)}}, sd, seed);
      const Surfels surfels = surfels_from_scan(scan);
      // Edges across the grid look up to 1.4 times as wide.
      EXPECT_NEAR(make_scene_depth(scan, surfels).edge_blur_px, 1.2 * sd, 0.35 * sd);
    }
}

TEST(EdgeBlur, IsNoneWhereStepsAreSharp) {
  const Mesh mesh = block();
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Scan scan = blurred_scan({{&mesh, over_table(seed)}}, 0, seed);
    const Surfels surfels = surfels_from_scan(scan);
    EXPECT_EQ(make_scene_depth(scan, surfels).edge_blur_px, 0);
  }
}

TEST(EdgeBlur, SteepFacesAreNoBlur) {
  // A block whose long side is seen at 70 deg all over: every row has a run of steep pixels beside a sharp step.
  const Mesh mesh = block();
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::AngleAxisd((18 + 0.2 * seed) * kDegree, Eigen::Vector3d::UnitY()).toRotationMatrix();
    pose.translation() = Eigen::Vector3d(0, 0, 470);
    const Scan scan = blurred_scan({{&mesh, pose}}, 0, seed);
    const Surfels surfels = surfels_from_scan(scan);
    EXPECT_EQ(make_scene_depth(scan, surfels).edge_blur_px, 0);
  }
}

TEST(VerifyPose, WhatTheSensorDrawsOutSpeaksNeitherForNorAgainst) {
  const Mesh mesh = block();
  const RenderMesh render_mesh = make_render_mesh(mesh);
  Mesh plate;
  test::add_box(plate, Vec3f(-20, -20, 0), Vec3f(20, 20, 10));
  VerificationOptions options;
  options.diameter_mm = 100;
  for (unsigned seed = 1; seed <= 10; ++seed)
    for (const double sd : {0.0, 1.5, 3.0}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", blur " << sd);
      const Pose truth = over_table(seed);
      const Scan scan = blurred_scan({{&mesh, truth}}, sd, seed);
      const Surfels surfels = surfels_from_scan(scan);
      const SceneDepth scene = make_scene_depth(scan, surfels);
      const Verification right = verify_pose(render_mesh, scene, truth, options);
      EXPECT_GT(right.support(), 0.95);
      EXPECT_GT(right.contour(), 0.95);
      EXPECT_LT(right.free_space(), 0.01);
      EXPECT_GT(right.outline, 40);
      // A plate pushed into the floor: no blur makes an outline of it.
      Pose in_floor = Pose::Identity();
      in_floor.translation() = Eigen::Vector3d(-130, 0, -kFloor);
      const Verification wrong = verify_pose(make_render_mesh(plate), scene, in_floor, options);
      EXPECT_GT(wrong.support(), 0.97);
      EXPECT_LT(wrong.contour(), 0.05);
    }
}

TEST(DrawOut, ShowsWhatTheSensorShows) {
  const Mesh mesh = block();
  const RenderMesh render_mesh = make_render_mesh(mesh);
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const Pose truth = over_table(seed);
    const Scan scan = blurred_scan({{&mesh, truth}}, 2.5, seed);
    const Surfels surfels = surfels_from_scan(scan);
    const SceneDepth scene = make_scene_depth(scan, surfels);
    /// Rms of the scan along outlines [mm], and of what it is off in sigmas, at a pose.
    const auto off = [&](const Pose& pose) {
      IndexRender render;
      render_index(render_mesh, scene.camera, pose, 1, render);
      const DrawnOut edges = draw_out(scene, render);
      double mm2 = 0, sigma2 = 0, n = 0;
      for (int j = 0; j < edges.height; ++j)
        for (int i = 0; i < edges.width; ++i) {
          const std::size_t k = edges.index(i, j);
          if (!(edges.z_mm[k] > 0)) continue;
          const int u = render.u0 - edges.left + i, v = render.v0 - edges.top + j;
          const double e = scene.z_mm(u, v) - edges.z_mm[k];
          mm2 += e * e;
          sigma2 += e * e / (edges.sigma_mm[k] * edges.sigma_mm[k] + 0.3 * 0.3);
          ++n;
        }
      EXPECT_GT(n, 1000);
      return std::pair{std::sqrt(mm2 / n), std::sqrt(sigma2 / n)};
    };
    // Steps of 50 to 110 mm, drawn over ten pixels. The blur is measured to a fifth.
    EXPECT_LT(off(truth).first, 6);
    EXPECT_LT(off(truth).second, 1);
    Pose aside = truth;
    aside.translation() += Eigen::Vector3d(4 * std::cos(seed), 4 * std::sin(seed), 0);
    EXPECT_GT(off(aside).first, 2 * off(truth).first);
    EXPECT_GT(off(aside).second, 1.5 * off(truth).second);
  }
}

TEST(RefinePose, FindsAFaceByItsOutlineThoughItIsDrawnOut) {
  // Seen from straight above, the face says nothing of a slide; the outline does to a fraction of the blur.
  const Mesh mesh = block();
  const RenderMesh render_mesh = make_render_mesh(mesh);
  RefineOptions options;
  options.start_scale_mm = 2;
  options.lever_mm = 35;
  options.outlines = true;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    const double sd = 2.5;
    const Pose truth = over_table(seed);
    const Scan scan = blurred_scan({{&mesh, truth}}, sd, seed);
    const Surfels surfels = surfels_from_scan(scan);
    const SceneDepth scene = make_scene_depth(scan, surfels);
    Pose start = truth;
    start.translation() += Eigen::Vector3d(3 * std::cos(seed), 3 * std::sin(seed), 0);
    const Pose end = refine_pose(render_mesh, scene, start, options).camera_from_part;
    const double pixel_mm = 450.0 / scan.camera.fx;
    EXPECT_LT((end.translation() - truth.translation()).norm(), 0.5 * sd * pixel_mm);
  }
}

}  // namespace
}  // namespace tribin
