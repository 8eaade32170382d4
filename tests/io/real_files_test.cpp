#include <gtest/gtest.h>

#include "support/shared_data.hpp"
#include "tribin/cad/measure.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/scan_files.hpp"

namespace tribin {
namespace {

struct RealScan {
  const char* name;
  std::size_t valid;
  double fx, cx, cy;
};

TEST(RealScans, OrganizedCloudsGiveTheirCamera) {
  // Kinects by PCL have f = 525, c = (319.5, 239.5) exactly; the stereo rig's are its calibration.
  for (const RealScan& truth :
       {RealScan{"real/mosd/learn33.pcd", 179131, 525, 319.5, 239.5},
        {"real/mosd/test0.pcd", 189198, 525, 319.5, 239.5},
        {"real/mosd/test31.pcd", 170909, 525, 319.5, 239.5},
        {"real/mosd/test35.pcd", 173116, 525, 319.5, 239.5},
        {"real/pcl_tutorials/milk_cartoon_all_small_clorox.pcd", 241407, 525, 319.5, 239.5},
        {"real/pcl_tutorials/table_scene_mug_stereo_textured.pcd", 209280, 964.359, 319.807, 223.364}}) {
    const auto path = test::shared_data(truth.name);
    TRIBIN_NEED_DATA(path);
    SCOPED_TRACE(truth.name);
    const Scan scan = read_scan(path);
    EXPECT_EQ(scan.width(), 640);
    EXPECT_EQ(valid_count(scan), truth.valid);
    EXPECT_NEAR(scan.camera.fx, truth.fx, 0.01);
    EXPECT_NEAR(scan.camera.fy, truth.fx, 0.01);
    EXPECT_NEAR(scan.camera.cx, truth.cx, 0.01);
    EXPECT_NEAR(scan.camera.cy, truth.cy, 0.01);
    EXPECT_TRUE(scan.rays.empty());
  }
}

TEST(RealScans, DepthImageOfBop) {
  const auto path = test::shared_data("scenes_dev/test/000001/depth/000000.png");
  TRIBIN_NEED_DATA(path);
  const Scan scan = read_scan(path);  // scene_camera.json one folder up, image 0
  EXPECT_EQ(scan.width(), 1280);
  EXPECT_DOUBLE_EQ(scan.camera.fx, 1800);
  EXPECT_EQ(valid_count(scan), 1208956u);
  const Scan same = read_scan(path, {.camera_file = test::shared_data("scenes_dev/camera.json")});
  EXPECT_EQ(same.z_mm(640, 512), scan.z_mm(640, 512));
}

TEST(RealScans, DepthMapsInMetres) {
  const auto path = test::shared_data("real/phoxi/dex-net_4.0_depth_0.npy");
  TRIBIN_NEED_DATA(path);
  const Scan scan = read_scan(path, {.camera_file = test::shared_data("real/phoxi/phoxi.intr")});
  EXPECT_EQ(scan.width(), 516);
  EXPECT_DOUBLE_EQ(scan.camera.fx, 552.5);
  EXPECT_EQ(valid_count(scan), 135649u);
}

TEST(RealScans, LoosePointsTellWhereTheCameraStood) {
  const auto path = test::shared_data("real/elbows/90_real_2_pre.ply");
  TRIBIN_NEED_DATA(path);
  const PointSet points = read_points(path);
  EXPECT_EQ(points.points.size(), 48996u);
  EXPECT_NEAR(points.points[0].z(), -425.537, 1e-3);
  ASSERT_TRUE(points.viewpoint.has_value());
}

TEST(RealScans, AGridThatWasWrittenWithoutItsHolesIsRegained) {
  const auto path = test::shared_data("real/elbows/90_real_2_pre.ply");
  TRIBIN_NEED_DATA(path);
  const Scan scan = read_scan(path);
  EXPECT_EQ(scan.width(), 304);
  EXPECT_EQ(scan.height(), 204);
  EXPECT_EQ(valid_count(scan), 48996u);
  EXPECT_NEAR(std::abs(scan.camera.fx), 422.2, 0.2);  // what Intel says of a D435 at 848 x 480
  EXPECT_NEAR(std::abs(scan.camera.fy), 422.2, 0.2);
}

TEST(RealCad, PartsHaveTheSizeTheyAreSoldWith) {
  const auto path = test::shared_data("cad/o2ac/07_SBARB6200ZZ_30.stl");  // bearing in its housing: solids that touch
  TRIBIN_NEED_DATA(path);
  const Mesh mesh = read_cad(path);
  EXPECT_TRUE(mesh.oriented);
  EXPECT_NEAR(bounding_box(mesh.vertices).size().y(), 54, 1e-3);
  EXPECT_NEAR(diameter(mesh.vertices), 54.589, 1e-3);
}

TEST(RealCad, OneSolidIsOneWhateverTheFormat) {
  const auto path = test::shared_data("scenes_dev/cad/alternator_a.stl");
  TRIBIN_NEED_DATA(path);
  const Mesh stl = read_cad(path), dxf = read_cad(test::shared_data("scenes_dev/cad/alternator_a.dxf"));
  EXPECT_EQ(stl.triangles.size(), dxf.triangles.size());
  EXPECT_NEAR(signed_volume(stl) / signed_volume(dxf), 1, 1e-6);
}

TEST(RealCad, DxfWithSolidsIsRefused) {
  const auto path = test::shared_data("cad/dxf/ezdxf_uncommon.dxf");
  TRIBIN_NEED_DATA(path);
  EXPECT_THROW(read_cad(path), Error);
}

}  // namespace
}  // namespace tribin
