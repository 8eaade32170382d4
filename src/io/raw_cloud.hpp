#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/file_bytes.hpp"
#include "tribin/io/scan_files.hpp"

namespace tribin::io {

/// A cloud as the file has it: the file's unit and frame, holes as NaN or 0 0 0.
struct RawCloud {
  std::string name;
  int width = 0;
  int height = 1;                 ///< 1: loose points
  std::vector<Vec3f> points;      ///< width * height, row by row
  std::optional<Pose> viewpoint;  ///< of the PCD header: where the camera stood, in the file's unit
  Taken taken;
  std::vector<std::string> warnings;

  bool organized() const { return width > 1 && height > 1; }
};

// Parsers of clouds; each throws bad_input with line or byte.
RawCloud parse_pcd(const FileBytes& file);
RawCloud parse_ply_cloud(const FileBytes& file);
RawCloud parse_xyz(const FileBytes& file);

/// An array of floats as NPY and TIFF hold them: a depth image (channels = 1), an image of points or a list of them
/// (3).
struct RawArray {
  int width = 0;
  int height = 1;
  int channels = 1;
  bool list = false;          ///< N x 3: loose points
  std::vector<float> values;  ///< row by row, channels side by side
};
RawArray parse_npy(const FileBytes& file);
/// H x W or H x W x channels, 4-byte floats.
std::string encode_npy(const RawArray& array);

/// Without libtiff: \throws Error bad_option that names the package.
RawArray parse_tiff(const FileBytes& file);

RawCloud cloud_from_array(const FileBytes& file, RawArray array);

/// A point that is no measurement.
inline bool is_hole(const Vec3f& p) { return !p.allFinite() || (p.x() == 0 && p.y() == 0 && p.z() == 0); }

/// Millimetres per unit of the file, by option or guess.
double cloud_unit(const RawCloud& cloud, LengthUnit unit, std::vector<std::string>& warnings);

/// The scan of an organized cloud: finds the camera that sees point (u, v) in pixel (u, v).
/// \throws Error too_little_data for loose points or too few, bad_input when no pinhole or lens explains the grid.
Scan scan_from_cloud(RawCloud cloud, const ScanReadOptions& options);

PointSet points_from_cloud(const RawCloud& cloud, const ScanReadOptions& options);

}  // namespace tribin::io
