#include "tribin/sim/paper_experiment.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tribin/core/error.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/sim/dataset.hpp"

namespace tribin::sim {
namespace {

namespace fs = std::filesystem;

Mesh part(const std::string& name) {
  return read_cad(fs::path(TRIBIN_SOURCE_DIR) / "examples/parts" / (name + ".stl"));
}

TEST(PaperScene, EachPoseIsWhollyInViewAndTrue) {
  const Mesh mesh = part("alternator_a");
  const auto rests = stable_rests(mesh);
  for (int seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const PaperScene scene = paper_scene(mesh, rests, seed);
    EXPECT_EQ(scene.rest, (seed - 1) % static_cast<int>(rests.size()));
    EXPECT_LE(scene.tilt, 20 * kDegree);
    const BodyTruth& truth = scene.simulated.bodies[1];
    EXPECT_DOUBLE_EQ(truth.visible_fraction(), 1);
    EXPECT_GT(truth.pixels_measured, 0.6 * truth.pixels_visible);
    const auto& box = truth.box_all;
    EXPECT_TRUE(box[0] > 0 && box[1] > 0 && box[0] + box[2] < 1279 && box[1] + box[3] < 1023);
    // A pixel is 0.5 mm at 800 mm, the noise there 0.1 mm.
    EXPECT_NEAR(800 / scene.scan().camera.fx, 0.5, 1e-12);
  }
}

TEST(CramerRaoBound, ALeastSquaresFitOfTheVeryPixelsReachesIt) {
  // White noise: the linear fit of a pose offset to z - true z has the bound as its covariance.
  const Mesh mesh = part("alternator_b");
  const PaperScene scene = paper_scene(mesh, 1, {.noise_correlation_px = 0});
  const SimulatedScan& s = scene.simulated;
  const Matrix6 bound = cramer_rao_bound(s, 1, 0);
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (int v = 0; v < s.body.height; ++v)
    for (int u = 0; u < s.body.width; ++u) {
      if (s.body(u, v) != 1 || !std::isfinite(s.scan.z_mm(u, v))) continue;
      const double error = s.scan.z_mm(u, v) - s.true_z(u, v);
      if (std::abs(error) > 5 * s.sigma_mm(u, v)) continue;  // a mixed pixel
      const Vec3 n = s.normal(u, v).cast<double>(), ray = s.scan.camera.ray(u, v);
      const Vec3 p = ray * static_cast<double>(s.true_z(u, v)) - scene.camera_from_part.translation();
      Eigen::Matrix<double, 6, 1> j;
      j << n, p.cross(n);
      j /= n.dot(ray);
      right += j * error / (s.sigma_mm(u, v) * s.sigma_mm(u, v));
    }
  const Eigen::Matrix<double, 6, 6> covariance = bound;
  const Eigen::Matrix<double, 6, 1> estimate = covariance * right;
  const double chi2 = estimate.dot(covariance.inverse() * estimate);  // 6 degrees of freedom
  EXPECT_LT(chi2, 30) << "1 in 25,000 by chance; mixed pixels add a little";
  EXPECT_NEAR((cramer_rao_bound(s, 1, 1).trace()) / bound.trace(), 4 * kPi, 1e-6);
  EXPECT_LT(std::sqrt(bound.topLeftCorner<3, 3>().trace()), 0.01);
}

TEST(CramerRaoBound, SaysWhenThePixelsLeaveADirectionFree) {
  const Mesh mesh = part("alternator_b");
  const PaperScene scene = paper_scene(mesh, 1);
  EXPECT_THROW(cramer_rao_bound(scene.simulated, 0, 1), Error);  // the table slides on itself
}

TEST(Dataset, IsReadableAsBop) {
  const fs::path directory = fs::path(testing::TempDir()) / "tribin_table_dataset";
  fs::remove_all(directory);
  simulate_dataset({.parts = {part("alternator_a"), part("alternator_b")}, .scenes = 1, .seed = 3, .progress = {}},
                   directory);
  const auto json = [&](const std::string& name) { return nlohmann::json::parse(std::ifstream(directory / name)); };
  const auto gt = json("test/000001/scene_gt.json")["0"], info = json("test/000001/scene_gt_info.json")["0"];
  ASSERT_GE(gt.size(), 1u);
  ASSERT_EQ(gt.size(), info.size());
  for (std::size_t i = 0; i < gt.size(); ++i) {
    EXPECT_DOUBLE_EQ(info[i]["visib_fract"], 1.0);
    char mask[64];
    std::snprintf(mask, sizeof mask, "test/000001/mask_visib/000000_%06zu.png", i);
    EXPECT_TRUE(fs::exists(directory / mask));
  }
  EXPECT_TRUE(fs::exists(directory / "test/000001/depth/000000.png"));
  EXPECT_EQ(json("models/models_info.json").size(), 2u);
  EXPECT_EQ(json("test/000001/scene_camera.json")["0"]["cam_K"].size(), 9u);
  EXPECT_THROW(simulate_dataset({}, directory), Error);
  EXPECT_THROW(level_of("heavy"), Error);
  fs::remove_all(directory);
}

}  // namespace
}  // namespace tribin::sim
