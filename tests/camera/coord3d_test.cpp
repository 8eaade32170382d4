#include "tribin/camera/coord3d.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

constexpr int kWidth = 40, kHeight = 30;
const PinholeCamera kCamera{kWidth, kHeight, 60, 60, 19.5, 14.5};

/// A slanted plane with one hole at pixel 7.
double true_z(int i) { return 500 + 3 * (i % kWidth) + 2 * (i / kWidth); }
constexpr int kHole = 7;

/// Raw words of the plane in a format, with scale and offset taken out.
template <class Word>
std::vector<std::byte> encoded(const Coord3dImage& image, bool planar, bool z_alone, double hole) {
  const int pixels = kWidth * kHeight, channels = z_alone ? 1 : 3;
  std::vector<std::byte> out(std::size_t(pixels) * channels * sizeof(Word) + 100);  // cameras may send more
  for (int i = 0; i < pixels; ++i) {
    const Vec3 p = kCamera.point(i % kWidth, i / kWidth, true_z(i)) / image.unit_mm;
    for (int c = 0; c < channels; ++c) {
      const int k = z_alone ? 2 : c;
      double raw = (p[k] - image.offset[k]) / image.scale[k];
      if (i == kHole) raw = hole;
      if constexpr (std::is_integral_v<Word>) raw = std::round(raw);
      const Word word = static_cast<Word>(raw);
      const int at = planar ? c * pixels + i : i * channels + c;
      std::memcpy(out.data() + std::size_t(at) * sizeof(Word), &word, sizeof word);
    }
  }
  return out;
}

void expect_plane(const Scan& scan, double tolerance) {
  ASSERT_EQ(scan.width(), kWidth);
  EXPECT_EQ(valid_count(scan), std::size_t(kWidth * kHeight - 1));
  EXPECT_TRUE(std::isnan(scan.z_mm.data[kHole]));
  for (int i = 0; i < kWidth * kHeight; ++i) {
    if (i == kHole) continue;
    const Vec3 p = scan.input_from_camera * scan.point(i % kWidth, i / kWidth);
    EXPECT_NEAR((p - kCamera.point(i % kWidth, i / kWidth, true_z(i))).norm(), 0, tolerance) << i;
  }
}

Coord3dImage image_of(Coord3dFormat format) {
  Coord3dImage image;
  image.format = format;
  image.width = kWidth, image.height = kHeight;
  return image;
}

TEST(Coord3d, FloatPointsInTurnAndPlaneByPlane) {
  for (const bool planar : {false, true}) {
    Coord3dImage image = image_of(planar ? Coord3dFormat::abc32f_planar : Coord3dFormat::abc32f);
    for (const double hole : {0.0, double(std::numeric_limits<float>::quiet_NaN()), -1e4}) {
      image.invalid_value.reset();
      if (hole == -1e4) image.invalid_value = hole;
      const auto bytes = encoded<float>(image, planar, false, hole);
      image.data = bytes;
      expect_plane(scan_from_coord3d(image, "camera"), 0.05);
    }
  }
}

TEST(Coord3d, ScaleOffsetAndUnitAreApplied) {
  Coord3dImage image = image_of(Coord3dFormat::abc16);
  image.scale = {0.01, 0.01, 0.015};
  image.offset = {-300, -300, 100};
  image.invalid_value = 0;
  const auto words = encoded<std::uint16_t>(image, false, false, 0);
  image.data = words;
  expect_plane(scan_from_coord3d(image, "camera"), 0.05);

  Coord3dImage metres = image_of(Coord3dFormat::abc32f);
  metres.unit_mm = 1000;
  const auto floats = encoded<float>(metres, false, false, 0);
  metres.data = floats;
  expect_plane(scan_from_coord3d(metres, "camera"), 0.05);
}

TEST(Coord3d, DepthsAloneWantTheFocalLength) {
  Coord3dImage image = image_of(Coord3dFormat::c16);
  image.scale[2] = 0.02;
  image.offset[2] = 50;
  image.invalid_value = 65535;
  const auto words = encoded<std::uint16_t>(image, false, true, 65535);
  image.data = words;
  EXPECT_THROW(scan_from_coord3d(image, "camera"), Error);
  image.camera = kCamera;
  expect_plane(scan_from_coord3d(image, "camera"), 0.05);
}

TEST(Coord3d, TooFewBytesAreTheDevicesFault) {
  Coord3dImage image = image_of(Coord3dFormat::abc32f);
  const std::vector<std::byte> bytes(coord3d_bytes(image.format, kWidth, kHeight) - 1);
  image.data = bytes;
  try {
    scan_from_coord3d(image, "genicam:x");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::device);
    EXPECT_NE(std::string(e.what()).find("14400"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace tribin
