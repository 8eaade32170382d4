#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "tribin/scan/scan.hpp"

namespace tribin {

/// Point images of GenICam cameras (PFNC Coord3D_*, little endian).
enum class Coord3dFormat {
  abc32f,         ///< x, y, z of each pixel in turn, float
  abc32f_planar,  ///< all x, all y, all z
  abc16,          ///< as abc32f, unsigned 16 bit
  c32f,           ///< z alone
  c16             ///< z alone, unsigned 16 bit
};

/// What a camera sent, and how its features say that it is to be read.
struct Coord3dImage {
  Coord3dFormat format = Coord3dFormat::abc32f;
  int width = 0, height = 0;
  std::span<const std::byte> data;           ///< may be longer than the image
  std::array<double, 3> scale{1, 1, 1};      ///< Scan3dCoordinateScale of A, B, C: value = scale raw + offset
  std::array<double, 3> offset{0, 0, 0};     ///< Scan3dCoordinateOffset
  std::optional<double> invalid_value = {};  ///< Scan3dInvalidDataValue: raw C of a hole, where the flag is set
  double unit_mm = 1;                        ///< Scan3dDistanceUnit
  PinholeCamera camera = {};  ///< of formats with z alone: Scan3dFocalLength, Scan3dPrincipalPointU and V
};

/// Bytes of an image, from its size and format: what cameras say themselves may be more.
std::size_t coord3d_bytes(Coord3dFormat format, int width, int height);

/// The scan of a point image. Holes: the invalid value, NaN, 0 0 0, and z alone at 0 or below.
/// \param source  for messages.
/// \throws Error device for fewer bytes than the image has, bad_input for z alone without a focal length, and as
///               read_scan where the points are those of no camera.
Scan scan_from_coord3d(const Coord3dImage& image, const std::string& source);

}  // namespace tribin
