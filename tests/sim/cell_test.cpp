#include <gtest/gtest.h>

#include "sim/drawn_scene.hpp"
#include "sim/foreign_objects.hpp"
#include "tribin/core/error.hpp"
#include "tribin/sim/simulated_camera.hpp"

namespace tribin::sim {
namespace {

/// A bin 900 mm below the camera, turned and off the middle.
CellView some_cell() {
  CellView cell;
  cell.camera = {320, 256, 450, 450, 159.5, 127.5};
  cell.noise.sigma_mm = 0.2;
  cell.bin = {300, 220, 120, 6};
  cell.camera_from_bin.linear() =
      Matrix3(rotation_from_vector(Vec3(kPi, 0, 0)) * rotation_from_vector(Vec3(0.1, 0, 0.4)));
  cell.camera_from_bin.translation() = Vec3(30, -20, 900);
  return cell;
}

TEST(CellScene, HeapsStayInTheCellsOwnBin) {
  const std::vector<Mesh> parts = foreign_objects(60);
  const SceneStock stock = make_stock(parts, SceneKind::bin, settings_of(Level::dense));
  const CellView cell = some_cell();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const DrawnScene scene = draw_bin_scene(stock, SceneKind::bin, settings_of(Level::dense), seed, cell);
    EXPECT_TRUE(scene.camera_from_world.isApprox(cell.camera_from_bin));
    EXPECT_EQ(scene.sensor.noise_mm, 0.2);
    EXPECT_EQ(scene.sensor.camera.width, 320);
    ASSERT_GT(scene.bodies.size(), 2u);
    for (std::size_t b = 2; b < scene.bodies.size(); ++b) {
      const Pose bin_from_part = scene.camera_from_world.inverse() * scene.bodies[b].camera_from_body;
      for (const Vec3f& v : scene.bodies[b].mesh->vertices) {
        const Vec3 p = bin_from_part * Vec3(v.cast<double>());
        // 1 mm: what parts may sink into walls while they rest.
        EXPECT_LT(std::abs(p.x()), cell.bin.length_mm / 2 + 1);
        EXPECT_LT(std::abs(p.y()), cell.bin.width_mm / 2 + 1);
        EXPECT_GT(p.z(), -1);
      }
    }
  }
}

TEST(CellScene, FewPartsWhereFewFit) {
  const std::vector<Mesh> parts = foreign_objects(60);
  const SceneStock stock = make_stock(parts, SceneKind::bin, settings_of(Level::hard));
  CellView cell = some_cell();
  const std::size_t many = draw_bin_scene(stock, SceneKind::bin, settings_of(Level::hard), 1, cell).bodies.size();
  cell.bin = {90, 80, 50, 5};
  const std::size_t few = draw_bin_scene(stock, SceneKind::bin, settings_of(Level::hard), 1, cell).bodies.size();
  EXPECT_LT(few, many);
  EXPECT_GT(few, 2u);
  cell.bin = {90, 80, 1, 5};
  EXPECT_THROW(draw_bin_scene(stock, SceneKind::bin, settings_of(Level::hard), 1, cell), Error);
}

TEST(CellScene, TheCameraMustSeeTheBin) {
  const std::vector<Mesh> parts = foreign_objects(60);
  const SceneStock stock = make_stock(parts, SceneKind::bin, settings_of(Level::easy));
  for (const Vec3& place : {Vec3(0, 0, -900), Vec3(900, 0, 900)}) {
    CellView cell = some_cell();
    cell.camera_from_bin.translation() = place;
    try {
      draw_bin_scene(stock, SceneKind::bin, settings_of(Level::easy), 1, cell);
      ADD_FAILURE();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::out_of_range);
    }
  }
}

TEST(SimulatedCamera, NewScenesThatTheSeedFixes) {
  const auto first = open_simulated_camera(some_cell(), foreign_objects(60), {.seed = 5});
  const auto again = open_simulated_camera(some_cell(), foreign_objects(60), {.seed = 5});
  std::vector<std::size_t> counts;
  for (int shot = 0; shot < 2; ++shot) {
    const Scan a = std::get<Scan>(first->grab().content), b = std::get<Scan>(again->grab().content);
    ASSERT_EQ(a.z_mm.size(), b.z_mm.size());
    for (std::size_t i = 0; i < a.z_mm.size(); ++i)
      ASSERT_TRUE(a.z_mm.data[i] == b.z_mm.data[i] || (std::isnan(a.z_mm.data[i]) && std::isnan(b.z_mm.data[i])));
    counts.push_back(valid_count(a));
    EXPECT_GT(counts.back(), a.z_mm.size() / 4);
  }
  EXPECT_NE(counts[0], counts[1]);
}

TEST(SimulatedCamera, RenderedFramesMeasureTheSameScene) {
  CellView cell = some_cell();
  cell.camera = {160, 128, 225, 225, 79.5, 63.5};
  cell.noise = {};
  const std::vector<Mesh> parts = foreign_objects(60);
  const Scan fast = std::get<Scan>(open_simulated_camera(cell, parts, {.seed = 2})->grab().content);
  Shot shot = open_simulated_camera(cell, parts, {.seed = 2, .frames = true})->grab();
  ASSERT_TRUE(shot.rig);
  const Scan rendered = scan_of(std::move(shot), {}).result.scan;
  std::vector<float> off;
  for (std::size_t i = 0; i < fast.z_mm.size(); ++i) {
    const float d = std::abs(fast.z_mm.data[i] - rendered.z_mm.data[i]);
    if (std::isfinite(d)) off.push_back(d);
  }
  ASSERT_GT(off.size(), fast.z_mm.size() / 4);
  std::nth_element(off.begin(), off.begin() + off.size() / 2, off.end());
  EXPECT_LT(off[off.size() / 2], 1);  // noise at this resolution is some tenths of a millimetre
}

}  // namespace
}  // namespace tribin::sim
