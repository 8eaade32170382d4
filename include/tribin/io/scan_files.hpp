#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "tribin/io/units.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin {

/// How to read a scan.
struct ScanReadOptions {
  /// Camera file of a depth image; empty: camera.json beside the scan, or BOP's scene_camera.json one folder up.
  std::filesystem::path camera_file;
  /// Entry of a BOP scene_camera.json; < 0: the number that is the scan's file name (000003.png -> 3).
  int image_id = -1;
  /// Unit of clouds and of images of floats. `automatic`: metres where the median range is below 20, else millimetres;
  /// a warning says so. Integer depth images go by depth_scale of the camera file.
  LengthUnit unit = LengthUnit::automatic;
};

using ScanOrPoints = std::variant<Scan, PointSet>;

/// Reads an organized scan: 16-bit depth PNG or TIFF, float XYZ TIFF, organized PCD or PLY, NPY (H x W, H x W x 3).
/// A cloud gets its camera by least squares on x/z and y/z; where that misses by more than 0.1 px rms the scan carries
/// its rays. A camera that looks along -z is turned: `input_from_camera` leads back to the file's frame.
/// \throws Error bad_input (file, place, seen, wanted), too_little_data (no valid pixel, or loose points where a grid
///               is due), bad_option (a depth image without camera file).
/// \cost         1280 x 1024: about 15 ms binary PCD, 25 ms PNG.
Scan read_scan(const std::filesystem::path& path, const ScanReadOptions& options = {});

/// Reads loose points [mm, the file's frame], holes left out; an organized file loses its grid.
PointSet read_points(const std::filesystem::path& path, const ScanReadOptions& options = {});

/// Reads whichever the file holds: a grid or loose points.
ScanOrPoints read_scan_or_points(const std::filesystem::path& path, const ScanReadOptions& options = {});

/// File extensions that read_scan_or_points knows, lower case, with dot.
std::vector<std::string> scan_extensions();

}  // namespace tribin
