#include "io/depth_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tribin::io {
namespace {

constexpr float kHole = std::numeric_limits<float>::quiet_NaN();

/// The number that a BOP file name is (000003.png -> 3), or -1.
int number_of_name(const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  if (stem.empty() || stem.size() > 9 || stem.find_first_not_of("0123456789") != std::string::npos) return -1;
  return std::stoi(stem);
}

Scan with_camera(const std::string& name, int width, int height, const CameraFile& file) {
  Scan scan;
  scan.source = name;
  scan.camera = file.camera;
  if ((file.camera.width && file.camera.width != width) || (file.camera.height && file.camera.height != height)) {
    bad_file(name, "", "an image of " + std::to_string(width) + " x " + std::to_string(height),
             "the camera file's " + std::to_string(file.camera.width) + " x " + std::to_string(file.camera.height));
  }
  scan.camera.width = width;
  scan.camera.height = height;
  scan.noise = file.noise;
  if (file.distorted()) {
    CameraFile sized = file;
    sized.camera = scan.camera;
    scan.rays = undistorted_rays(sized);
  }
  return scan;
}

Scan checked(Scan scan) {
  if (valid_count(scan) == 0) {
    bad_file(scan.source, "", "no pixel with a depth", "a scan with measurements", ErrorCode::too_little_data);
  }
  return scan;
}

}  // namespace

CameraFile camera_of_image(const std::filesystem::path& image, const ScanReadOptions& options) {
  const int id = options.image_id >= 0 ? options.image_id : number_of_name(image);
  if (!options.camera_file.empty()) return read_camera_file(options.camera_file, id);
  const auto folder = image.parent_path();
  auto own = image;  // STEM.camera.json, as write_scan leaves it
  own.replace_extension(".camera.json");
  for (const auto& candidate : {own, folder / "camera.json", folder / ".." / "scene_camera.json"}) {
    if (std::filesystem::is_regular_file(candidate)) return read_camera_file(candidate, id);
  }
  bad_file(image.string(), "", "a depth image without camera file",
           "--camera camera.json (cam_K, depth_scale), or camera.json beside the image", ErrorCode::bad_option);
}

Scan scan_from_steps(const std::string& name, const Image<std::uint16_t>& steps, const CameraFile& file) {
  Scan scan = with_camera(name, steps.width, steps.height, file);
  if (!file.depth_scale_mm) {
    scan.warnings.push_back("the camera file has no depth_scale: depths are taken as whole millimetres");
  }
  const float scale = static_cast<float>(file.depth_scale_mm.value_or(1.0));
  scan.z_mm = Image<float>(steps.width, steps.height);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    scan.z_mm.data[i] = steps.data[i] ? static_cast<float>(steps.data[i]) * scale : kHole;
  }
  return checked(std::move(scan));
}

Scan scan_from_floats(const std::string& name, Image<float> depth, const CameraFile& file, LengthUnit unit) {
  Scan scan = with_camera(name, depth.width, depth.height, file);
  std::vector<float> ranges;
  for (float& z : depth.data) {
    if (!std::isfinite(z) || z <= 0) {
      z = kHole;
    } else if (unit == LengthUnit::automatic && !file.depth_scale_mm) {
      ranges.push_back(z);
    }
  }
  double scale = file.depth_scale_mm.value_or(1.0);
  if (unit != LengthUnit::automatic) {
    scale = millimetres_in(unit);
  } else if (!file.depth_scale_mm) {
    scale = guess_unit(ranges, scan.warnings);
  }
  for (float& z : depth.data) z = static_cast<float>(z * scale);
  scan.z_mm = std::move(depth);
  return checked(std::move(scan));
}

double guess_unit(std::vector<float>& ranges, std::vector<std::string>& warnings) {
  if (ranges.empty()) return 1;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  if (*middle >= 20) return 1;
  char text[160];
  std::snprintf(text, sizeof text, "no unit is given; a median range of %.3g was taken as metres (else say unit mm)",
                static_cast<double>(*middle));
  warnings.push_back(text);
  return 1000;
}

}  // namespace tribin::io
