#pragma once

#include <array>
#include <filesystem>
#include <optional>

#include "tribin/core/camera.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin {

/// What a camera file says: intrinsics, the depth step and, where given, how noisy the camera is.
///
/// JSON with BOP's keys: `cam_K` (9 numbers, row-wise) or `fx, fy, cx, cy`; `depth_scale` [mm per step of the depth
/// image]; `width`, `height`. Further, optional: `depth_unit` ("mm" | "m", for images of floats), `distortion`
/// [k1, k2, p1, p2, k3] (Brown, as OpenCV), `noise_mm`, `noise_correlation_px`, `scale_error`, `offset_mm`.
struct CameraFile {
  PinholeCamera camera;                             ///< width and height are 0 where the file has none
  std::optional<double> depth_scale_mm;             ///< [mm per step]
  std::array<double, 5> distortion{0, 0, 0, 0, 0};  ///< k1, k2, p1, p2, k3
  NoiseProfile noise;

  bool distorted() const;
};

/// Reads a camera file: camera.json, BOP's scene_camera.json (one camera for each image), or Photoneo's .intr.
/// \param image_id  which entry of a scene_camera.json; ignored for the others.
/// \throws Error    bad_input, naming the file and the key or byte.
CameraFile read_camera_file(const std::filesystem::path& path, int image_id = -1);

/// Writes camera.json. \throws Error bad_input when the file cannot be written.
void write_camera_file(const std::filesystem::path& path, const CameraFile& camera);

/// The rays (z = 1) of the pixels of a camera with lens distortion, by inversion of Brown's model.
/// \throws Error out_of_range where the distortion folds the image, so that a pixel has no single ray.
Image<Vec3f> undistorted_rays(const CameraFile& camera);

}  // namespace tribin
