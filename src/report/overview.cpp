#include <algorithm>

#include "report/canvas.hpp"
#include "report/html.hpp"
#include "report/pictures.hpp"
#include "report/shapes.hpp"
#include "report/sighting.hpp"
#include "tribin/eval/eval.hpp"

namespace tribin::report {
namespace {

/// Leaves out the rows of a picture, above and below, where no part was found; a twelfth of its width stays around
/// them.
void keep_rows_with_parts(View& view, std::span<const Part> parts, const std::vector<Instance>& instances) {
  double low = 1e300, high = -1e300;
  for (const Instance& instance : instances)
    for (const Part& part : parts) {
      if (part.name != instance.part) continue;
      for (const Vec3f& x : part.mesh.vertices) {
        const double y = view.project(instance.camera_from_part * x.cast<double>()).y();
        low = std::min(low, y), high = std::max(high, y);
      }
    }
  if (low > high) return;
  low = std::max(0.0, low - view.width / 12.0), high = std::min<double>(view.height, high + view.width / 12.0);
  if (high - low < 80) return;
  const Vec3 shift(0, (0.5 * (low + high) - 0.5 * view.height) / view.px_per_mm, 0);
  view.center += view.view_from_world.transpose() * shift;
  view.height = static_cast<int>(high - low);
}

}  // namespace

std::string overview(const Observation& seen, std::span<const Part> parts, const std::vector<Instance>& instances) {
  constexpr int kWidth = 1060;
  const Scan& scan = seen.scan;
  // The parallel view along the optical axis that shows what the camera saw at the scan's middle depth.
  std::vector<double> depths;
  for (const Vec3f& p : seen.surfels.position) depths.push_back(p.z());
  if (depths.empty()) return {};
  const double z = eval::quantile(depths, 0.5);
  const double px_per_mm = kWidth * scan.camera.fx / (z * scan.width());
  const int height = std::min(900, static_cast<int>(px_per_mm * z * scan.height() / scan.camera.fy));
  View view = view_along(Vec3::UnitZ(), Vec3::UnitY(), scan.camera.point(0.5 * scan.width(), 0.5 * scan.height(), z),
                         kWidth / px_per_mm, kWidth, height);
  keep_rows_with_parts(view, parts, instances);
  Canvas canvas(view);
  const Sighting all = whole_scan(scan, seen.surfels, seen.primitives);
  Image<std::uint8_t> found(scan.width(), scan.height(), 0);
  for (const Instance& instance : instances)
    for (const Part& part : parts) {
      if (part.name != instance.part) continue;
      const Sighting on = sighting_of(scan, seen.surfels, seen.primitives, part, instance.camera_from_part);
      for (std::size_t i = 0; i < found.size() && on.on_part.size() == found.size(); ++i)
        found.data[i] |= on.on_part.data[i];
    }
  canvas.draw(surface_of(scan, seen.surfels, all, std::max(1, scan.width() / 640),
                         [&](int u, int v) { return PixelLook{found(u, v) ? Material::grey : Material::faint}; }));
  const auto class_of = [&](const Instance& instance) {
    return static_cast<int>(
        std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == instance.part; }) -
        parts.begin());
  };
  for (const Instance& instance : instances) {
    const int k = class_of(instance);
    if (k >= static_cast<int>(parts.size())) continue;
    Canvas hidden(view);
    hidden.draw(surface_of(parts[k].mesh, instance.camera_from_part, Material::grey));
    std::swap(hidden.depth, canvas.depth);
    Image<std::uint8_t> before = canvas.indices;
    draw_edges(canvas, parts[k].mesh, edges_of(parts[k].mesh), instance.camera_from_part, Material::class_line, 2.4,
               1.2);
    const std::uint8_t drawn = index_of(Material::class_line, 0.5), wanted = index_of(Material::height, 0.75, k % 6);
    for (std::size_t i = 0; i < before.size(); ++i)
      if (canvas.indices.data[i] == drawn && before.data[i] != drawn) canvas.indices.data[i] = wanted;
    std::swap(hidden.depth, canvas.depth);
  }
  return "<figure class=\"wide\"><div class=\"art\">" +
         picture(canvas.indices, palette(false, -1), palette(true, -1),
                 "The scan with the outline of every part found") +
         "</div><figcaption>The scan from the camera's eye, with the CAD outline of every part found in its class's "
         "colour; what no part explains is pale, what was not measured is empty.</figcaption></figure>\n";
}

}  // namespace tribin::report
