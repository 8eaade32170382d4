#include "tribin/pose/refine.hpp"

#include <gtest/gtest.h>

#include "support/posed_scan.hpp"
#include "support/solids.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/pose/verification.hpp"

namespace tribin {
namespace {

/// A block with a step and a post: three pairs of faces and no symmetry.
Mesh stepped_block() {
  Mesh mesh;
  test::add_box(mesh, Vec3f(-40, -25, -15), Vec3f(40, 25, 15));
  test::add_box(mesh, Vec3f(-40, -25, 15), Vec3f(5, 10, 30));
  test::add_box(mesh, Vec3f(15, -20, 15), Vec3f(27, -8, 22));
  return mesh;
}

RefineOptions options_for_block() {
  RefineOptions options;
  options.start_scale_mm = 2;
  options.lever_mm = 35;
  return options;
}

TEST(RenderIndex, SeesTheDepthOfAPlaneFace) {
  Mesh mesh;
  test::add_box(mesh, Vec3f(-10, -10, -10), Vec3f(10, 10, 10));
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(0, 0, 510);
  const PinholeCamera camera{200, 160, 500, 500, 99.5, 79.5};
  IndexRender render;
  render_index(make_render_mesh(mesh), camera, pose, 1, render);
  EXPECT_EQ(render.silhouette_pixels, 400u);  // 20 mm at 500 mm and 500 px: 20 x 20 pixels
  for (std::size_t i = 0; i < render.triangle.size(); ++i)
    if (render.triangle[i] >= 0) {
      EXPECT_NEAR(1 / render.inverse_z[i], 500, 1e-3);
    }
}

/// 1/z of the first facet that a ray of the camera meets; 0 = none.
double cast(const Mesh& mesh, const Pose& pose, const Vec3& ray) {
  double nearest = 0;
  for (const auto& t : mesh.triangles) {
    Eigen::Matrix3d m;  // the ray is a positive sum of the corners where it meets the triangle: m s = ray, sum(s) = 1/z
    for (int k = 0; k < 3; ++k) m.col(k) = pose * mesh.vertices[t[static_cast<std::size_t>(k)]].cast<double>();
    if (std::abs(m.determinant()) < 1e-9) continue;
    const Eigen::Vector3d s = m.inverse() * Eigen::Vector3d(ray);
    if (s.minCoeff() >= 0) nearest = std::max(nearest, s.sum());
  }
  return nearest;
}

TEST(RenderIndex, SeesWhatRaysMeet) {
  const Mesh mesh = stepped_block();
  const RenderMesh render_mesh = make_render_mesh(mesh);
  const PinholeCamera camera{120, 90, 700, 650, 57.3, 44.1};
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Pose pose = test::random_pose(600, seed);
    pose.translation() += Eigen::Vector3d(seed % 3 ? 0 : 40, seed % 4 ? 0 : -30, 0);  // some are cut by the border
    const int step = 1 + static_cast<int>(seed % 3);
    IndexRender render;
    render_index(render_mesh, camera, pose, step, render);
    int seen = 0, wrong = 0;
    for (int v = 0; v < camera.height; v += step)
      for (int u = 0; u < camera.width; u += step) {
        const int i = (u - render.u0) / step, j = (v - render.v0) / step;
        const bool inside = u >= render.u0 && v >= render.v0 && i < render.width && j < render.height;
        const double rendered = inside ? render.inverse_z[render.index(i, j)] : 0;
        const double truth = cast(mesh, pose, camera.ray(u, v));
        seen += truth > 0;
        wrong += std::abs(rendered - truth) > 1e-5 * truth;
      }
    EXPECT_GT(seen, 100);
    EXPECT_LE(wrong, seen / 500 + 1);  // a ray through an edge may go either way
  }
}

TEST(RefinePose, MeetsTheTruthWithinTheNoise) {
  const Mesh mesh = stepped_block();
  const RenderMesh render_mesh = make_render_mesh(mesh);
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    const Pose truth = test::random_pose(600, seed);
    const Scan scan = test::posed_scan({{&mesh, truth}}, Vec3(0, 0, -1), -720, 0.1, 0.6, seed);
    const Surfels surfels = surfels_from_scan(scan);
    const SceneDepth scene = make_scene_depth(scan, surfels);
    Vector6 off;
    off << 0.5, -0.4, 0.6, 0.008, -0.006, 0.007;
    RefineOptions options = options_for_block();
    options.outlines = true;  // from some sides one face is all that is seen
    options.by_patches = seed % 2 == 0;
    const Refinement refined = refine_pose(render_mesh, scene, moved(truth, off), options);
    const Eigen::Vector3d error = refined.camera_from_part.translation() - truth.translation();
    const double turn = rotation_angle(refined.camera_from_part.linear(), truth.linear());
    // Five standard deviations of its own information, and the outline's raster along the directions that one face
    // leaves open.
    const Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>(refined.information).inverse();
    EXPECT_LT(error.norm(), 5 * std::sqrt(covariance.topLeftCorner<3, 3>().trace()) + 0.02);
    EXPECT_LT(turn, 5 * std::sqrt(covariance.bottomRightCorner<3, 3>().trace()) + 0.02 * kDegree);
  }
}

TEST(RefinePose, LeavesAFrozenDirectionAlone) {
  const Mesh mesh = stepped_block();
  const Pose truth = test::random_pose(600, 3);
  const Scan scan = test::posed_scan({{&mesh, truth}}, Vec3(0, 0, -1), -720, 0.05, 0, 3);
  const Surfels surfels = surfels_from_scan(scan);
  const SceneDepth scene = make_scene_depth(scan, surfels);
  Pose start = truth;
  start.translation().z() += 0.7;
  RefineOptions options = options_for_block();
  Vector6 along_z = Vector6::Zero();
  along_z[2] = 1;
  options.frozen = {along_z};
  const Refinement refined = refine_pose(make_render_mesh(mesh), scene, start, options);
  // Rotations turn about the box centre, which is the origin here: nothing else may move it along z.
  EXPECT_NEAR(refined.camera_from_part.translation().z(), start.translation().z(), 1e-9);
}

TEST(RefinePose, LeavesAlongAFaceAloneWhatTheFaceDoesNotHold) {
  // The top of a plate, seen along its normal: three directions are held to microns, three by nothing.
  Mesh plate;
  test::add_box(plate, Vec3f(-60, -45, -8), Vec3f(60, 45, 0));
  Mesh sight = plate;  // what is seen goes on beyond the part: no outline helps
  test::add_box(sight, Vec3f(-160, -145, -8), Vec3f(160, 145, 0));
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    Pose truth = Pose::Identity();
    truth.linear() = rotation_from_vector(Vec3(kPi, 0, 0));
    truth.translation() = Eigen::Vector3d(0, 0, 600);
    const Scan scan = test::posed_scan({{&sight, truth}}, Vec3(0, 0, -1), -720, 0.1, 0.6, seed);
    const Surfels surfels = surfels_from_scan(scan);
    const SceneDepth scene = make_scene_depth(scan, surfels);
    Vector6 off;
    off << 1.5, -1, 0.5, 0.005, -0.004, 0.02;
    RefineOptions options = options_for_block();
    options.weak_mm = 1;
    options.outlines = true;
    const Pose start = moved(truth, off);
    const Pose refined = refine_pose(make_render_mesh(plate), scene, start, options).camera_from_part;
    const Eigen::Vector3d shift = refined.translation() - start.translation();
    EXPECT_LT(std::hypot(shift.x(), shift.y()), 0.02);  // what the tilt's correction gives, nothing slides
    EXPECT_NEAR(refined.translation().z(), truth.translation().z(), 0.02);
    EXPECT_LT(
        rotation_angle(Matrix3(refined.linear() * truth.linear().transpose()), rotation_from_vector(Vec3(0, 0, 0.02))),
        0.02 * kDegree);
  }
}

TEST(RefinePose, GivesTheSameBytesOnAnyNumberOfThreads) {
  const Mesh mesh = stepped_block();
  const Pose truth = test::random_pose(600, 5);
  const Scan scan = test::posed_scan({{&mesh, truth}}, Vec3(0, 0, -1), -720, 0.1, 1, 5);
  const Surfels surfels = surfels_from_scan(scan);
  const SceneDepth scene = make_scene_depth(scan, surfels);
  RefineOptions options = options_for_block();
  options.outlines = true;
  set_thread_count(1);
  const Refinement one = refine_pose(make_render_mesh(mesh), scene, truth, options);
  set_thread_count(2);
  const Refinement two = refine_pose(make_render_mesh(mesh), scene, truth, options);
  set_thread_count(0);
  EXPECT_TRUE(one.camera_from_part.matrix() == two.camera_from_part.matrix());
  EXPECT_TRUE(one.information == two.information);
}

TEST(VerifyPose, TellsTheRightPoseFromOneThatHangsInTheAir) {
  const Mesh mesh = stepped_block();
  const Pose truth = test::random_pose(600, 7);
  const Scan scan = test::posed_scan({{&mesh, truth}}, Vec3(0, 0, -1), -720, 0.1, 0.6, 7);
  const Surfels surfels = surfels_from_scan(scan);
  const SceneDepth scene = make_scene_depth(scan, surfels);
  VerificationOptions options;
  options.diameter_mm = 100;
  const Verification right = verify_pose(make_render_mesh(mesh), scene, truth, options);
  EXPECT_GT(right.support(), 0.97);
  EXPECT_GT(right.contour(), 0.9);
  EXPECT_LT(right.free_space(), 0.01);
  Pose nearer = truth;
  nearer.translation().z() -= 40;
  EXPECT_GT(verify_pose(make_render_mesh(mesh), scene, nearer, options).free_space(), 0.8);
}

TEST(VerifyPose, AFaceInTheFloorHasNoOutline) {
  // A plate pushed into the floor: the floor supports every pixel of it, and goes on beyond its outline.
  Mesh plate;
  test::add_box(plate, Vec3f(-40, -30, 0), Vec3f(40, 30, 10));
  const Scan scan = test::posed_scan({}, Vec3(0, 0, -1), -600, 0.1, 0.6, 9);
  const Surfels surfels = surfels_from_scan(scan);
  const SceneDepth scene = make_scene_depth(scan, surfels);
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(0, 0, 600);
  VerificationOptions options;
  options.diameter_mm = 100;
  const Verification v = verify_pose(make_render_mesh(plate), scene, pose, options);
  EXPECT_GT(v.support(), 0.97);
  EXPECT_LT(v.contour(), 0.05);
}

}  // namespace
}  // namespace tribin
