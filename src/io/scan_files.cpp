#include "tribin/io/scan_files.hpp"

#include <algorithm>
#include <cmath>

#include "io/depth_image.hpp"
#include "io/png.hpp"
#include "io/raw_cloud.hpp"
#include "io/taken.hpp"

namespace tribin {
namespace {

using io::FileBytes;
using io::RawArray;
using io::RawCloud;

/// What a file holds before it is known whether a grid or loose points are wanted.
using Content = std::variant<Scan, RawCloud>;

Content content_of_array(const std::filesystem::path& path, const FileBytes& file, RawArray array,
                         const ScanReadOptions& options) {
  if (array.channels == 3) return io::cloud_from_array(file, std::move(array));
  Image<float> depth;
  depth.width = array.width;
  depth.height = array.height;
  depth.data = std::move(array.values);
  const CameraFile camera = io::camera_of_image(path, options);
  return io::scan_from_floats(file.name, std::move(depth), camera, options.unit);
}

Content content_of(const std::filesystem::path& path, const std::string& extension, const FileBytes& file,
                   const ScanReadOptions& options) {
  if (extension == ".png") {
    const auto steps = io::decode_png16(file);  // before the camera is looked for: it may not be a depth image at all
    return io::scan_from_steps(file.name, steps, io::camera_of_image(path, options));
  }
  if (extension == ".pcd") return io::parse_pcd(file);
  if (extension == ".ply") return io::parse_ply_cloud(file);
  if (extension == ".npy") return content_of_array(path, file, io::parse_npy(file), options);
  if (extension == ".tif" || extension == ".tiff") return content_of_array(path, file, io::parse_tiff(file), options);
  return io::parse_xyz(file);
}

Content read_content(const std::filesystem::path& path, const ScanReadOptions& options) {
  const std::string extension = io::lower_extension(path);
  const auto known = scan_extensions();
  if (std::find(known.begin(), known.end(), extension) == known.end()) {
    std::string list;
    for (const std::string& e : known) list += (list.empty() ? "" : " ") + e;
    io::bad_file(path.string(), "", "extension " + io::in_quotes(extension), "a scan (" + list + ")");
  }
  const FileBytes file = io::read_file(path);
  Content content = content_of(path, extension, file, options);
  std::visit([&](auto& c) { io::read_taken(path, file.view(), c.taken, c.warnings); }, content);
  return content;
}

}  // namespace

std::vector<std::string> scan_extensions() {
  return {".pcd", ".ply", ".png", ".tif", ".tiff", ".npy", ".xyz", ".txt", ".csv", ".pts", ".asc"};
}

Scan read_scan(const std::filesystem::path& path, const ScanReadOptions& options) {
  Content content = read_content(path, options);
  if (auto* scan = std::get_if<Scan>(&content)) return std::move(*scan);
  return io::scan_from_cloud(std::get<RawCloud>(std::move(content)), options);
}

PointSet read_points(const std::filesystem::path& path, const ScanReadOptions& options) {
  Content content = read_content(path, options);
  if (auto* cloud = std::get_if<RawCloud>(&content)) return io::points_from_cloud(*cloud, options);
  const Scan& scan = std::get<Scan>(content);
  PointSet set{
      .points = {}, .viewpoint = Vec3::Zero(), .taken = scan.taken, .source = scan.source, .warnings = scan.warnings};
  for (int v = 0; v < scan.height(); ++v) {
    for (int u = 0; u < scan.width(); ++u) {
      if (std::isfinite(scan.z_mm(u, v))) set.points.push_back(Vec3f(scan.point(u, v).cast<float>()));
    }
  }
  return set;
}

ScanOrPoints read_scan_or_points(const std::filesystem::path& path, const ScanReadOptions& options) {
  Content content = read_content(path, options);
  if (auto* scan = std::get_if<Scan>(&content)) return std::move(*scan);
  auto& cloud = std::get<RawCloud>(content);
  if (!cloud.organized()) return io::points_from_cloud(cloud, options);
  try {
    return io::scan_from_cloud(std::move(cloud), options);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::bad_input) throw;
    PointSet points = read_points(path, options);  // read again, which is rare, rather than copied each time
    points.warnings.push_back("the grid is not used: " + std::string(error.what()));
    return points;
  }
}

}  // namespace tribin
