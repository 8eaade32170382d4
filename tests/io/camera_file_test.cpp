#include "tribin/io/camera_file.hpp"

#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

TEST(CameraFile, ComesBackAsItWasWritten) {
  const test::TemporaryFolder folder;
  CameraFile truth;
  truth.camera = {640, 480, 525.25, 526.5, 319.5, 239.125};
  truth.depth_scale_mm = 0.05;
  truth.noise.sigma_mm = 0.1;
  truth.noise.correlation_px = 1;
  write_camera_file(folder.path() / "camera.json", truth);
  const CameraFile seen = read_camera_file(folder.path() / "camera.json");
  EXPECT_EQ(seen.camera.width, 640);
  EXPECT_EQ(seen.camera.fy, 526.5);
  EXPECT_EQ(seen.camera.cy, 239.125);
  EXPECT_EQ(seen.depth_scale_mm, 0.05);
  EXPECT_EQ(seen.noise.sigma_mm, 0.1);
  EXPECT_EQ(seen.noise.correlation_px, 1);
}

TEST(CameraFile, RefusesWhatItCannotHold) {
  const test::TemporaryFolder folder;
  for (const char* text :
       {"", "hello", "[1]", "{}", R"({"cam_K": [1,2,3]})", R"({"cam_K": [500,1,320,0,500,240,0,0,1]})",
        R"({"fx": 0, "fy": 500, "cx": 1, "cy": 1})", R"({"fx": "a", "fy": 500, "cx": 1, "cy": 1})",
        R"({"fx": 500, "fy": 500, "cx": 1, "cy": 1, "width": -3})", R"({"0": {}, "1": {}})",
        R"({"fx": 500, "fy": 500, "cx": 1, "cy": 1, "depth_scale": 0})"}) {
    SCOPED_TRACE(text);
    try {
      read_camera_file(folder.write("camera.json", text), 7);
      ADD_FAILURE() << "was read";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(error.what()).find("camera.json"), std::string::npos);
    }
  }
}

TEST(CameraFile, RaysUndoTheDistortion) {
  CameraFile file;
  file.camera = {64, 48, 60, 60, 31.5, 23.5};
  file.distortion = {-0.2, 0.05, 0.001, -0.002, 0.01};
  const Image<Vec3f> rays = undistorted_rays(file);
  const auto [k1, k2, p1, p2, k3] = file.distortion;
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const double x = rays(u, v).x(), y = rays(u, v).y(), r2 = x * x + y * y;
      const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
      const double seen_x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
      const double seen_y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
      EXPECT_NEAR(60 * seen_x + 31.5, u, 1e-4);
      EXPECT_NEAR(60 * seen_y + 23.5, v, 1e-4);
    }
  }
}

}  // namespace
}  // namespace tribin
