#include "tribin/io/scan_files.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/write.hpp"

namespace tribin {
namespace {

constexpr float kHole = std::numeric_limits<float>::quiet_NaN();

/// A bumpy surface with holes, seen by a camera that the seed draws.
Scan make_scan(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> one(0, 1);
  Scan scan;
  scan.camera = {64 + static_cast<int>(random() % 40), 48 + static_cast<int>(random() % 30), 0, 0, 0, 0};
  scan.camera.fx = 80 + 100 * one(random);
  scan.camera.fy = scan.camera.fx * (0.9 + 0.2 * one(random));
  scan.camera.cx = 0.5 * scan.camera.width + 10 * one(random);
  scan.camera.cy = 0.5 * scan.camera.height - 10 * one(random);
  scan.z_mm = Image<float>(scan.camera.width, scan.camera.height, kHole);
  for (int v = 0; v < scan.height(); ++v) {
    for (int u = 0; u < scan.width(); ++u) {
      if (random() % 10) scan.z_mm(u, v) = static_cast<float>(700 + 60 * std::sin(0.1 * u) * std::cos(0.13 * v) + u);
    }
  }
  return scan;
}

void expect_same_camera(const Scan& seen, const Scan& truth, double tolerance_px) {
  ASSERT_EQ(seen.width(), truth.width());
  ASSERT_EQ(seen.height(), truth.height());
  EXPECT_NEAR(seen.camera.fx, truth.camera.fx, tolerance_px);
  EXPECT_NEAR(seen.camera.fy, truth.camera.fy, tolerance_px);
  EXPECT_NEAR(seen.camera.cx, truth.camera.cx, tolerance_px);
  EXPECT_NEAR(seen.camera.cy, truth.camera.cy, tolerance_px);
}

void expect_same_depth(const Scan& seen, const Scan& truth, double tolerance_mm) {
  for (std::size_t i = 0; i < truth.z_mm.size(); ++i) {
    ASSERT_EQ(std::isfinite(seen.z_mm.data[i]), std::isfinite(truth.z_mm.data[i])) << i;
    if (std::isfinite(truth.z_mm.data[i])) {
      ASSERT_NEAR(seen.z_mm.data[i], truth.z_mm.data[i], tolerance_mm) << i;
    }
  }
}

TEST(ReadScan, CloudsAndImagesComeBackWithTheirCamera) {
  const test::TemporaryFolder folder;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const char* name : {"scan.pcd", "scan.ply", "scan.png"}) {
      SCOPED_TRACE(std::to_string(seed) + " " + name);
      const Scan truth = make_scan(seed);
      write_scan(folder.path() / name, truth);
      const Scan seen = read_scan(folder.path() / name);
      expect_same_camera(seen, truth, 2e-3);
      expect_same_depth(seen, truth, std::string(name) == "scan.png" ? 0.0081 : 1e-4);
      EXPECT_TRUE(seen.rays.empty());
      EXPECT_TRUE(seen.input_from_camera.matrix().isIdentity(1e-12));
    }
  }
}

/// An ascii PCD of points in any frame.
std::string pcd_of(const Scan& scan, const Pose& file_from_camera, double scale, const std::string& viewpoint) {
  std::string out = "VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH " +
                    std::to_string(scan.width()) + "\nHEIGHT " + std::to_string(scan.height()) + "\nVIEWPOINT " +
                    viewpoint + "\nPOINTS " + std::to_string(scan.z_mm.size()) + "\nDATA ascii\n";
  for (int v = 0; v < scan.height(); ++v) {
    for (int u = 0; u < scan.width(); ++u) {
      if (!std::isfinite(scan.z_mm(u, v))) {
        out += "nan nan nan 1.0\n";
        continue;
      }
      const Vec3 p = scale * (file_from_camera * scan.point(u, v));
      char line[120];
      std::snprintf(line, sizeof line, "%.9g %.9g %.9g 4.2e-39\n", p.x(), p.y(), p.z());
      out += line;
    }
  }
  return out;
}

TEST(ReadScan, FindsTheCameraInAnyFrameAndLeadsBack) {
  const test::TemporaryFolder folder;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Pose backward = Pose::Identity();  // y up, camera along -z
  backward.linear() = Matrix3(Vec3(1, -1, -1).asDiagonal());
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Scan truth = make_scan(seed);
    Pose world = Pose::Identity();
    world.linear() = rotation_from_vector(Vec3(normal(random), normal(random), normal(random)));
    world.translation() = 300 * Vec3(normal(random), normal(random), normal(random));
    for (const Pose& frame : {Pose::Identity(), backward, world}) {
      const bool in_metres = seed % 2;
      const auto path = folder.write("a.pcd", pcd_of(truth, frame, in_metres ? 0.001 : 1, "0 0 0 1 0 0 0"));
      const Scan seen = read_scan(path);
      expect_same_camera(seen, truth, 0.2);
      expect_same_depth(seen, truth, 0.5);
      for (int v = 0; v < truth.height(); v += 7) {
        for (int u = 0; u < truth.width(); u += 7) {
          if (!std::isfinite(truth.z_mm(u, v))) continue;
          EXPECT_LT((seen.input_from_camera * seen.point(u, v) - frame * truth.point(u, v)).norm(), 0.02);
        }
      }
    }
  }
}

TEST(ReadScan, HonoursAViewpointThatTheGridConfirms) {
  const test::TemporaryFolder folder;
  Scan truth = make_scan(3);
  for (float& z : truth.z_mm.data) z = std::isfinite(z) ? 700.f : z;  // a plane: the grid alone cannot tell its camera
  Pose world = Pose::Identity();
  world.linear() = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5).toRotationMatrix();
  world.translation() = Vec3(100, 200, 300);
  const Scan seen = read_scan(folder.write("a.pcd", pcd_of(truth, world, 1, "100 200 300 0.5 0.5 -0.5 0.5")));
  expect_same_camera(seen, truth, 0.05);
  EXPECT_LT((seen.input_from_camera.matrix() - world.matrix()).norm(), 1e-6);
}

TEST(ReadScan, TurnsMirroredAndTransposedGrids) {
  const test::TemporaryFolder folder;
  const Scan truth = make_scan(9);
  Scan mirrored = truth;
  for (int v = 0; v < truth.height(); ++v) {  // the rows upside down: x, y, z stay with their value
    for (int u = 0; u < truth.width(); ++u) mirrored.z_mm(u, v) = truth.z_mm(u, truth.height() - 1 - v);
  }
  mirrored.camera.fy = -truth.camera.fy;
  mirrored.camera.cy = truth.height() - 1 - truth.camera.cy;
  const Scan seen = read_scan(folder.write("m.pcd", pcd_of(mirrored, Pose::Identity(), 1, "0 0 0 1 0 0 0")));
  expect_same_camera(seen, truth, 0.05);
  expect_same_depth(seen, truth, 1e-3);
  EXPECT_FALSE(seen.warnings.empty());
  // Column by column: the same points, each with its own x, y, z, in the other order.
  std::string text = "ply\nformat ascii 1.0\ncomment width = " + std::to_string(truth.height()) +
                     "\ncomment height: " + std::to_string(truth.width()) + "\nelement vertex " +
                     std::to_string(truth.z_mm.size()) +
                     "\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
  for (int u = 0; u < truth.width(); ++u) {
    for (int v = 0; v < truth.height(); ++v) {
      const Vec3 p = std::isfinite(truth.z_mm(u, v)) ? truth.point(u, v) : Vec3(Vec3::Zero());
      text += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    }
  }
  const Scan turned = read_scan(folder.write("t.ply", text));
  expect_same_camera(turned, truth, 0.05);
  expect_same_depth(turned, truth, 1e-3);
}

TEST(ReadScan, KeepsTheRaysOfALens) {
  const test::TemporaryFolder folder;
  Scan truth = make_scan(11);
  truth.rays = Image<Vec3f>(truth.width(), truth.height(), Vec3f::Zero());
  for (int v = 0; v < truth.height(); ++v) {
    for (int u = 0; u < truth.width(); ++u) {
      const Vec3 ray = truth.camera.ray(u, v);
      const double r2 = ray.head<2>().squaredNorm();
      truth.rays(u, v) =
          Vec3f(static_cast<float>(ray.x() * (1 + 0.5 * r2)), static_cast<float>(ray.y() * (1 + 0.5 * r2)), 1);
    }
  }
  write_scan(folder.path() / "lens.ply", truth);
  const Scan seen = read_scan(folder.path() / "lens.ply");
  ASSERT_FALSE(seen.rays.empty());
  for (std::size_t i = 0; i < truth.rays.size(); ++i) {
    EXPECT_LT((seen.rays.data[i] - truth.rays.data[i]).norm(), 1e-3) << i;  // holes too, by the smooth model
  }
  EXPECT_THROW(write_scan(folder.path() / "lens.png", truth), Error);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "lens.png"));
}

TEST(ReadScan, DoesNotInventACamera) {
  const test::TemporaryFolder folder;
  std::string text =
      "ply\nformat ascii 1.0\nobj_info num_cols 30\nobj_info num_rows 30\nelement vertex 900\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n";
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(100, 200);
  for (int i = 0; i < 900; ++i)
    text += std::to_string(any(random)) + " " + std::to_string(any(random)) + " " + std::to_string(any(random)) + "\n";
  const auto path = folder.write("noise.ply", text);
  EXPECT_THROW(read_scan(path), Error);
  const ScanOrPoints points = read_scan_or_points(path);  // as loose points they are fine
  ASSERT_TRUE(std::holds_alternative<PointSet>(points));
  EXPECT_EQ(std::get<PointSet>(points).points.size(), 900u);
  EXPECT_FALSE(std::get<PointSet>(points).warnings.empty());
}

TEST(ReadPoints, ReadsTextInItsManyForms) {
  const test::TemporaryFolder folder;
  for (const char* text : {"30 0 0\n0 40 0\n0 0 50\n", "x,y,z\n30,0,0\n0,40,0\n0,0,50\n",
                           "# made by\n3\n30 0 0 7\r\n0 40 0 8\r\n0 0 50 9", "30;0;0\n\n0;+40;0\n0;0;50"}) {
    SCOPED_TRACE(text);
    const PointSet points = read_points(folder.write("a.xyz", text));
    ASSERT_EQ(points.points.size(), 3u);
    EXPECT_EQ(points.points[1], Vec3f(0, 40, 0));
  }
}

TEST(ReadPoints, TakesMetresBelowTwenty) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("a.xyz", "0 0 0.7\n0.1 0 0.8\n0 0.1 0.9\n");
  EXPECT_FLOAT_EQ(read_points(path).points[0].z(), 700);
  EXPECT_EQ(read_points(path).warnings.size(), 1u);
  EXPECT_FLOAT_EQ(read_points(path, {.camera_file = {}, .image_id = -1, .unit = LengthUnit::millimetre}).points[0].z(),
                  0.7f);
}

}  // namespace
}  // namespace tribin
