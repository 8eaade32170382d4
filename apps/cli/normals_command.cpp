#include <bit>
#include <cmath>
#include <fstream>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string scan, camera, out, method = "inverse_depth", scan_unit = "auto";
  SurfelOptions surfel;
};

struct OrientedPoint {
  float x, y, z, nx, ny, nz;
};

/// The normal of the surfel's quadric at a point beside its centre: dn = k1 d1 (d1.x) + k2 d2 (d2.x), where the
/// curvature stands out of its noise (3 sigma); else the surfel's own normal.
Vec3f normal_at(const Surfels& s, std::size_t i, const Vec3f& point) {
  Vec3f normal = s.normal[i];
  if (std::abs(s.curvature1[i]) < 3 * s.sigma_curvature[i] || s.direction2[i].isZero()) return normal;
  const Vec3f offset = point - s.position[i];
  const Vec3f d2 = s.direction2[i], d1 = d2.cross(normal);
  normal += s.curvature1[i] * d1.dot(offset) * d1 + s.curvature2[i] * d2.dot(offset) * d2;
  return normal.normalized();
}

std::vector<OrientedPoint> oriented_points(const Scan& scan, const Surfels& surfels) {
  std::vector<OrientedPoint> out;
  const Matrix3 turn = scan.input_from_camera.linear();
  for (int v = 0; v < scan.height(); ++v) {
    for (int u = 0; u < scan.width(); ++u) {
      if (!std::isfinite(scan.z_mm(u, v))) continue;
      const int cu = u / surfels.cell_px, cv = v / surfels.cell_px;
      if (!surfels.surfel_of_cell.contains(cu, cv)) continue;
      const int surfel = surfels.surfel_of_cell(cu, cv);
      if (surfel < 0) continue;
      const Vec3 camera_point = scan.point(u, v);
      const Vec3f normal = normal_at(surfels, surfel, camera_point.cast<float>());
      const Vec3 p = scan.input_from_camera * camera_point, n = turn * normal.cast<double>();
      out.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
                     static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z())});
    }
  }
  return out;
}

int run(const Options& options, const Context&) {
  static_assert(std::endian::native == std::endian::little);
  if (options.method != "inverse_depth")
    throw Error(ErrorCode::bad_option, "--method " + options.method + ": not built yet; wanted inverse_depth");
  const Scan scan = read_scan_logged(options.scan, options.camera, options.scan_unit);
  const std::vector<OrientedPoint> points = oriented_points(scan, surfels_from_scan(scan, options.surfel));
  StagedOutput staged(options.out);
  std::ofstream file(staged.path(), std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\ncomment millimetres; normals towards the camera\nelement vertex "
       << points.size();
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) file << "\nproperty float " << name;
  file << "\nend_header\n";
  file.write(reinterpret_cast<const char*>(points.data()),
             static_cast<std::streamsize>(points.size() * sizeof(OrientedPoint)));
  file.close();
  if (!file) throw Error(ErrorCode::bad_option, options.out + ": cannot be written (is the disk full?)");
  staged.publish();
  return 0;
}

}  // namespace

void add_normals(CLI::App& app, Context& context) {
  auto options = std::make_shared<Options>();
  CLI::App* command = add_command(app, context, "normals", "Write the points of a scan with their surface normals",
                                  "tribin normals bin.pcd -o normals.ply");
  command->add_option("SCAN", options->scan, "Scan: PCD, PLY, depth PNG or TIFF with camera.json, NPY")->required();
  command->add_option("-o", options->out, "PLY to write; pixels on edges have no normal and are left out")
      ->required()
      ->type_name("FILE.ply");
  command->add_option("--camera", options->camera, "Camera file of a depth image")->type_name("FILE");
  command->add_option("--scan-unit", options->scan_unit, "Unit of clouds: mm, m, auto")->type_name("U");
  command->add_option("--method", options->method, "inverse_depth")->type_name("M");
  only_experts(command->add_option("--cell-px", options->surfel.cell_px), context);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
