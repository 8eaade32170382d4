#include "tribin/sim/cell_view.hpp"

#include "tribin/core/error.hpp"
#include "tribin/io/camera_file.hpp"

namespace tribin::sim {

CellView cell_view_of(const WorkCell& cell, const std::optional<Pose>& base_from_flange) {
  if (!cell.bin) throw Error(ErrorCode::bad_input, cell.file.string() + ": saw no [bin], wanted one to simulate");
  const CameraFile camera = read_camera_file(cell.camera->file);
  const std::string file = cell.camera->file.string();
  if (camera.camera.width == 0 || camera.camera.height == 0)
    throw Error(ErrorCode::bad_input, file + ": saw no width and height, wanted them to simulate the camera");
  if (camera.distorted())
    throw Error(ErrorCode::bad_input,
                file + ": saw a lens distortion, wanted none: the simulated camera is a pinhole, as scans of rigs are");
  const Vec3& size = cell.bin->inner_size_mm;
  return {camera.camera,
          camera.noise,
          base_from_camera(cell, base_from_flange).inverse() * cell.bin->base_from_bin,
          {size.x(), size.y(), size.z(), cell.bin->wall_mm}};
}

}  // namespace tribin::sim
