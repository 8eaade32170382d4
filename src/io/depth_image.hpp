#pragma once

#include <filesystem>

#include "io/file_bytes.hpp"
#include "tribin/io/camera_file.hpp"
#include "tribin/io/scan_files.hpp"

namespace tribin::io {

/// The camera of a depth image: options.camera_file, or one found beside the image.
/// \throws Error bad_option when there is none.
CameraFile camera_of_image(const std::filesystem::path& image, const ScanReadOptions& options);

/// A scan from integer depths: 0 = hole, else times depth_scale.
/// \throws Error bad_input where image and camera disagree in size, too_little_data where no pixel is valid.
Scan scan_from_steps(const std::string& name, const Image<std::uint16_t>& steps, const CameraFile& camera);

/// A scan from float depths; NaN, inf and values <= 0 are holes.
Scan scan_from_floats(const std::string& name, Image<float> depth, const CameraFile& camera, LengthUnit unit);

/// Millimetres per unit of ranges whose unit is not known: metres below a median of 20, else millimetres. Depth cameras
/// for picking stand 0.2 m to 5 m off, that is 0.2 to 5 or 200 to 5000: 20 lies far from both (no such camera is within
/// 20 mm of its parts, none sees small parts from beyond 20 m).
/// \param ranges  absolute z or distances, finite; reordered here. Adds a warning where it takes metres.
double guess_unit(std::vector<float>& ranges, std::vector<std::string>& warnings);

}  // namespace tribin::io
