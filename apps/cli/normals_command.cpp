#include <bit>
#include <cmath>
#include <fstream>

#include "commands.hpp"
#include "output.hpp"
#include "tribin/core/error.hpp"
#include "tribin/surfel/pixel_normals.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin::cli {
namespace {

struct Options {
  std::string scan, camera, out, method = "inverse_depth", scan_unit = "auto";
  int window_px = 0;
};

struct OrientedPoint {
  float x, y, z, nx, ny, nz;
};

OrientedPoint oriented(const Vec3& p, const Vec3& n) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()),
          static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z())};
}

std::vector<OrientedPoint> oriented_points(const Scan& scan, const NormalOptions& options) {
  std::vector<OrientedPoint> out;
  const Image<Vec3f> normals = pixel_normals(scan, options);
  const Matrix3 turn = scan.input_from_camera.linear();
  for (int v = 0; v < scan.height(); ++v)
    for (int u = 0; u < scan.width(); ++u)
      if (std::isfinite(scan.z_mm(u, v)))
        out.push_back(oriented(scan.input_from_camera * scan.point(u, v), turn * normals(u, v).cast<double>()));
  return out;
}

std::vector<OrientedPoint> oriented_points(const PointSet& points) {
  const Surfels surfels = surfels_from_points(points);
  std::vector<OrientedPoint> out;
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    const std::uint32_t k = surfels.surfel_of_point[i];
    const bool known = surfels.sigma_normal[k] < 1;
    out.push_back(
        oriented(points.points[i].cast<double>(), known ? Vec3(surfels.normal[k].cast<double>()) : Vec3(0, 0, 0)));
  }
  return out;
}

int run(const Options& options, const Context&) {
  static_assert(std::endian::native == std::endian::little);
  NormalOptions how{.window_px = options.window_px};
  if (options.method == "tangent_mask") how.method = NormalMethod::tangent_mask;
  const ScanOrPoints input = read_scan_or_points_logged(options.scan, options.camera, options.scan_unit);
  const Scan* scan = std::get_if<Scan>(&input);
  if (scan == nullptr && how.method == NormalMethod::tangent_mask)
    throw Error(ErrorCode::bad_option, "--method tangent_mask: " + options.scan +
                                           " holds loose points, the mask wants the rows and columns of a scan");
  const std::vector<OrientedPoint> points =
      scan != nullptr ? oriented_points(*scan, how) : oriented_points(std::get<PointSet>(input));
  StagedOutput staged(options.out);
  std::ofstream file(staged.path(), std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\ncomment millimetres; normals towards the camera, of loose points "
          "outwards; 0 0 0 = none\nelement vertex "
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
  CLI::App* command =
      add_command(app, context, "normals", "Write the points of a scan or cloud with their surface normals",
                  "tribin normals bin.pcd -o normals.ply");
  add_any_scan(command, options->scan, options->camera, options->scan_unit);
  command->add_option("-o", options->out, "PLY to write: every point, with the normal 0 0 0 where it stands alone")
      ->required()
      ->type_name("FILE.ply");
  command->add_option("--method", options->method, "inverse_depth (default), or tangent_mask: the paper's")
      ->check(CLI::IsMember({"inverse_depth", "tangent_mask"}))
      ->type_name("M");
  only_experts(command->add_option("--window-px", options->window_px), context);
  command->callback([options, &context] { context.run = [options, &context] { return run(*options, context); }; });
}

}  // namespace tribin::cli
