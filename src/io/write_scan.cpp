#include <charconv>
#include <cmath>
#include <limits>

#include "io/binary.hpp"
#include "io/file_bytes.hpp"
#include "io/png.hpp"
#include "io/taken.hpp"
#include "tribin/io/camera_file.hpp"
#include "tribin/io/write.hpp"

namespace tribin {
namespace {

/// The points of a scan in its file's frame, holes as NaN: what the cloud formats hold.
std::vector<Vec3f> grid_of(const Scan& scan) {
  std::vector<Vec3f> points;
  points.reserve(scan.z_mm.size());
  for (int v = 0; v < scan.height(); ++v) {
    for (int u = 0; u < scan.width(); ++u) {
      if (std::isfinite(scan.z_mm(u, v))) {
        points.push_back(Vec3f((scan.input_from_camera * scan.point(u, v)).cast<float>()));
      } else {
        points.push_back(Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
      }
    }
  }
  return points;
}

std::string ply_of(const std::vector<Vec3f>& points, int width, int height) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment unit mm\n";
  if (height > 1)
    out += "obj_info num_cols " + std::to_string(width) + "\nobj_info num_rows " + std::to_string(height) + "\n";
  out += "element vertex " + std::to_string(points.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (const Vec3f& p : points) {
    for (int k = 0; k < 3; ++k) io::append(out, p[k]);
  }
  return out;
}

std::string pcd_of(const std::vector<Vec3f>& points, int width, int height, const Vec3& viewpoint) {
  const std::string place =
      std::to_string(viewpoint.x()) + " " + std::to_string(viewpoint.y()) + " " + std::to_string(viewpoint.z());
  std::string out =
      "# .PCD v0.7 - Point Cloud Data file format, millimetres\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F "
      "F\nCOUNT 1 1 1\nWIDTH " +
      std::to_string(width) + "\nHEIGHT " + std::to_string(height) + "\nVIEWPOINT " + place + " 1 0 0 0\nPOINTS " +
      std::to_string(points.size()) + "\nDATA binary\n";
  for (const Vec3f& p : points) {
    for (int k = 0; k < 3; ++k) io::append(out, p[k]);
  }
  return out;
}

std::string xyz_of(const std::vector<Vec3f>& points) {
  std::string out;
  for (const Vec3f& p : points) {
    if (!p.allFinite()) continue;
    for (int k = 0; k < 3; ++k) {
      char buffer[32];
      out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, p[k]).ptr).append(k < 2 ? " " : "\n");
    }
  }
  return out;
}

/// A 16-bit depth image with the finest step of 0.001 mm x 2^k that holds the farthest depth.
void write_depth_image(const std::filesystem::path& path, const Scan& scan) {
  if (!scan.rays.empty()) {
    throw Error(ErrorCode::bad_option, path.string() +
                                           ": saw a scan whose rays are no pinhole's, wanted a cloud format "
                                           "for it (.ply or .pcd): a depth image would lose them");
  }
  float farthest = 0;
  for (float z : scan.z_mm.data) farthest = std::isfinite(z) ? std::max(farthest, z) : farthest;
  double step = 0.001;
  while (farthest > 65535 * step) step *= 2;
  Image<std::uint16_t> steps(scan.width(), scan.height(), 0);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const float z = scan.z_mm.data[i];
    if (std::isfinite(z)) steps.data[i] = static_cast<std::uint16_t>(std::max(1.0, std::round(z / step)));
  }
  io::write_scan_file(path, scan.taken, io::encode_png16(steps));
  std::filesystem::path camera = path;
  camera.replace_extension(".camera.json");
  write_camera_file(camera, {.camera = scan.camera, .depth_scale_mm = step, .distortion = {}, .noise = scan.noise});
}

[[noreturn]] void unknown(const std::filesystem::path& path, const char* wanted) {
  io::bad_file(path.string(), "", "extension " + io::in_quotes(io::lower_extension(path)), wanted,
               ErrorCode::bad_option);
}

}  // namespace

std::vector<std::string> writable_scan_extensions() { return {".ply", ".pcd", ".xyz", ".png"}; }

void write_scan(const std::filesystem::path& path, const Scan& scan) {
  const std::string extension = io::lower_extension(path);
  if (extension == ".png") return write_depth_image(path, scan);
  // The camera's place is not written: the readers find it from the grid itself, exactly.
  if (extension == ".ply")
    return io::write_scan_file(path, scan.taken, ply_of(grid_of(scan), scan.width(), scan.height()));
  if (extension == ".pcd")
    return io::write_scan_file(path, scan.taken, pcd_of(grid_of(scan), scan.width(), scan.height(), Vec3::Zero()));
  if (extension == ".xyz") return io::write_scan_file(path, scan.taken, xyz_of(grid_of(scan)));
  unknown(path, "a scan to write (.ply .pcd .xyz .png)");
}

void write_points(const std::filesystem::path& path, const PointSet& set) {
  const std::string extension = io::lower_extension(path);
  const int count = static_cast<int>(set.points.size());
  if (extension == ".ply") return io::write_scan_file(path, set.taken, ply_of(set.points, count, 1));
  if (extension == ".pcd")
    return io::write_scan_file(path, set.taken, pcd_of(set.points, count, 1, set.viewpoint.value_or(Vec3::Zero())));
  if (extension == ".xyz") return io::write_scan_file(path, set.taken, xyz_of(set.points));
  unknown(path, "loose points to write (.ply .pcd .xyz)");
}

}  // namespace tribin
