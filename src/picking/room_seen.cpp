// Whether a scan shows that a room is empty.
#include <algorithm>
#include <cmath>

#include "tribin/picking/vision.hpp"

namespace tribin::picking {
namespace {

constexpr double kSigmas = 3;
constexpr double kSmallest_mm = 10;  // across, of a thing that would be in a part's way
constexpr double kSeen = 0.95;       // share of the room: single pixels miss a measurement anywhere
constexpr int kLooks = 12;           // along each side: between them a thing of a tenth of a part is not overlooked

}  // namespace

RoomSeen look_into(const Scan& scan, const Pose& base_from_camera, const Pose& base_from_box, const Vec3& size_mm,
                   double sigma_mm) {
  if (!scan.rays.empty()) return RoomSeen::hidden;  // its pixels are not found by a place in space
  const double margin = kSigmas * std::hypot(sigma_mm, std::max(scan.noise.sigma_mm, 0.0));
  const Vec3 half = (size_mm / 2 - Vec3::Constant(margin)).cwiseMax(0.0);
  const Pose camera_from_box = base_from_camera.inverse() * base_from_box, box_from_camera = camera_from_box.inverse();
  const PinholeCamera& camera = scan.camera;
  int looks = 0, free = 0, u_min = scan.width(), u_max = -1, v_min = scan.height(), v_max = -1;
  double depth = 0;
  for (int i = 0; i < kLooks; ++i)
    for (int j = 0; j < kLooks; ++j)
      for (int k = 0; k < kLooks; ++k, ++looks) {
        const Vec3 share = 2 * Vec3(i, j, k) / (kLooks - 1) - Vec3::Ones();
        const Vec3 p = camera_from_box * Vec3(share.cwiseProduct(half));
        if (!(p.z() > 0)) continue;
        const int u = static_cast<int>(std::lround(camera.fx * p.x() / p.z() + camera.cx));
        const int v = static_cast<int>(std::lround(camera.fy * p.y() / p.z() + camera.cy));
        if (u < 0 || v < 0 || u >= scan.width() || v >= scan.height()) continue;
        u_min = std::min(u_min, u), u_max = std::max(u_max, u), v_min = std::min(v_min, v), v_max = std::max(v_max, v);
        depth = std::max(depth, p.z());
        free += scan.z_mm(u, v) > p.z();
      }
  int inside = 0;
  for (int v = v_min; v <= v_max; ++v)
    for (int u = u_min; u <= u_max; ++u)
      if (scan.z_mm(u, v) > 0) inside += ((box_from_camera * scan.point(u, v)).cwiseAbs().array() < half.array()).all();
  const double pixel_mm = depth / camera.fx;
  if (depth > 0 && inside > kPi / 4 * std::pow(kSmallest_mm / pixel_mm, 2)) return RoomSeen::occupied;
  return free >= kSeen * looks ? RoomSeen::empty : RoomSeen::hidden;
}

}  // namespace tribin::picking
