#include "tribin/camera/folder_camera.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/taken_file.hpp"

namespace tribin {
namespace {

/// A stack of small pictures that are all different. \param bits  8, or more in 16.
FrameStack stack_of(const std::string& camera, int bits) {
  FrameStack out;
  out.camera = camera;
  out.patterns = make_patterns({.width = 64, .height = 48});
  out.patterns.back().exposure_ms = 2.5;
  if (bits > 8) out.full_scale = (1 << bits) - 1;
  for (std::size_t i = 0; i < out.patterns.size(); ++i) {
    Image<std::uint16_t> image(8, 6);
    for (std::size_t k = 0; k < image.size(); ++k) image.data[k] = static_cast<std::uint16_t>((37 * i + 11 * k) % 256);
    if (bits > 8) {
      image.data[0] = 4095;
      out.grey16.push_back(image);
    } else {
      out.grey8.emplace_back(8, 6);
      for (std::size_t k = 0; k < image.size(); ++k)
        out.grey8.back().data[k] = static_cast<std::uint8_t>(image.data[k]);
    }
  }
  return out;
}

Scan odd_scan() {
  Scan scan;
  scan.camera = {5, 4, 101.3, 99.7, 2.1, 1.9};
  scan.noise = {0.1, 0.5, 1e-4, 0};
  scan.z_mm = Image<float>(5, 4, 800.1f);
  scan.modulation = Image<std::uint8_t>(5, 4, 77);
  scan.invalid_reason = Image<std::uint8_t>(5, 4, 0);
  scan.rays = Image<Vec3f>(5, 4, Vec3f(0.1f, -0.2f, 1));
  for (int i = 0; i < 20; i += 3) {
    scan.z_mm.data[i] = std::numeric_limits<float>::quiet_NaN();
    scan.invalid_reason.data[i] = static_cast<std::uint8_t>(Invalid::shadow);
  }
  scan.input_from_camera.linear() = rotation_from_vector(Vec3(0.1, 0.2, 0.3));
  scan.input_from_camera.translation() = Vec3(1, 2, 1.0 / 3);
  return scan;
}

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

TEST(FolderCamera, GivesAScanAgainBitByBit) {
  const test::TemporaryFolder folder;
  Shot shot;
  const Scan scan = odd_scan();
  shot.content = scan;
  shot.taken.time_ms = 1'795'345'000'123;
  shot.taken.base_from_flange = robot_pose_from_text("yaskawa 600 0 900 180 10 0");
  shot.taken.flange_time_ms = 1'795'345'000'456;
  EXPECT_EQ(record_shot(folder.path() / "shots", shot).filename(), "000001");
  Shot again = open_folder_camera(folder.path() / "shots")->grab();
  EXPECT_EQ(again.taken.time_ms, shot.taken.time_ms);
  EXPECT_EQ(again.taken.flange_time_ms, shot.taken.flange_time_ms);
  const Scan back = scan_of(std::move(again), {}).result.scan;
  EXPECT_TRUE(same_bytes(back.z_mm.data, scan.z_mm.data));
  EXPECT_TRUE(same_bytes(back.rays.data, scan.rays.data));
  EXPECT_EQ(back.modulation.data, scan.modulation.data);
  EXPECT_EQ(back.invalid_reason.data, scan.invalid_reason.data);
  EXPECT_EQ(back.input_from_camera.matrix(), scan.input_from_camera.matrix());
  EXPECT_EQ(back.camera.fx, scan.camera.fx);
  EXPECT_EQ(back.noise.scale_error, scan.noise.scale_error);
  EXPECT_TRUE(back.taken.base_from_flange);
}

TEST(FolderCamera, GivesFramesOfEachCameraAgain) {
  const test::TemporaryFolder folder;
  for (const int bits : {8, 12}) {
    SCOPED_TRACE(bits);
    Shot shot;
    shot.content = std::vector<FrameStack>{stack_of("left", bits), stack_of("right", 8)};
    const auto place = record_shot(folder.path() / std::to_string(bits), shot);
    const Shot again = open_folder_camera(place)->grab();  // a single shot is a camera too
    const auto& stacks = std::get<std::vector<FrameStack>>(again.content);
    ASSERT_EQ(stacks.size(), 2u);
    const FrameStack first = stack_of("left", bits);
    EXPECT_EQ(stacks[0].camera, "left");
    EXPECT_EQ(stacks[0].full_scale, first.full_scale);
    EXPECT_EQ(stacks[0].patterns.back().exposure_ms, 2.5);
    ASSERT_EQ(stacks[0].patterns.size(), first.patterns.size());
    for (std::size_t i = 0; i < first.patterns.size(); ++i)
      EXPECT_TRUE(bits > 8 ? stacks[0].grey16[i].data == first.grey16[i].data
                           : stacks[0].grey8[i].data == first.grey8[i].data);
  }
}

TEST(FolderCamera, ShotsComeInOrderAndEnd) {
  const test::TemporaryFolder folder;
  Shot shot;
  for (int i = 1; i <= 3; ++i) {
    Scan scan = odd_scan();
    scan.z_mm.data[1] = static_cast<float>(i);
    shot.content = scan;
    record_shot(folder.path(), shot);
  }
  const auto camera = open_folder_camera(folder.path());
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(std::get<Scan>(camera->grab().content).z_mm.data[1], i);
  try {
    camera->grab();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::too_little_data);
  }
}

TEST(FolderCamera, NothingHalfWrittenStays) {
  const test::TemporaryFolder folder;
  folder.write("shots", "a file where the recording should be");
  Shot shot;
  shot.content = odd_scan();
  EXPECT_THROW(record_shot(folder.path() / "shots", shot), Error);
  EXPECT_THROW(open_folder_camera(folder.path() / "shots"), Error);
  EXPECT_THROW(open_folder_camera(folder.path()), Error);  // no shot in it
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::recursive_directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1u);
}

TEST(FolderCamera, FramesWantTheirRig) {
  Shot shot;
  shot.content = std::vector<FrameStack>{stack_of("left", 8)};
  try {
    scan_of(shot, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::bad_option);
  }
  Rig rig;
  rig.cameras.resize(1);
  rig.cameras[0].name = "other";
  try {
    scan_of(shot, rig);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
  }
}

}  // namespace
}  // namespace tribin
