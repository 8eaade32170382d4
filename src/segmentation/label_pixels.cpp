#include <algorithm>
#include <cmath>

#include "segmentation/fitting.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using namespace segmentation_detail;

constexpr int kReach = 2;  // cells: a cell at an edge is refused, and so may be the one beside it

}  // namespace

Image<std::uint16_t> label_pixels(const Primitives& primitives, const Surfels& surfels) {
  TRIBIN_ASSERT(surfels.scan != nullptr);
  const Scan& scan = *surfels.scan;
  Image<std::uint16_t> labels(scan.width(), scan.height(), 0);
  std::vector<Surface> surfaces;
  for (const Primitive& p : primitives.items) surfaces.push_back(surface_of(p));
  const int n = surfels.cell_px;
  const Image<std::int32_t>& cells = surfels.surfel_of_cell;
  const auto label_of_cell = [&](int column, int row) {
    if (!cells.contains(column, row) || cells(column, row) < 0) return 0;
    return primitives.label_of_surfel[static_cast<std::size_t>(cells(column, row))];
  };
  parallel_ranges(scan.height(), 64, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < scan.width(); ++u) {
        if (!std::isfinite(scan.z_mm(u, v))) continue;
        const int column = u / n, row = v / n;
        // The own cell first; pixels of refused cells (edges) may belong to a neighbouring cell's primitive.
        int candidates[(2 * kReach + 1) * (2 * kReach + 1)], count = 0;
        const int own = label_of_cell(column, row);
        if (own > 0) candidates[count++] = own;
        const bool refused = !cells.contains(column, row) || cells(column, row) < 0;
        if (refused || own == 0)
          for (int dv = -kReach; dv <= kReach; ++dv)
            for (int du = -kReach; du <= kReach; ++du) {
              const int label = label_of_cell(column + du, row + dv);
              if (label > 0 && std::find(candidates, candidates + count, label) == candidates + count)
                candidates[count++] = label;
            }
        if (count == 0) continue;
        const int tile_u = std::min(column / 8, surfels.local_sigma_mm.width - 1);
        const int tile_v = std::min(row / 8, surfels.local_sigma_mm.height - 1);
        const Vec3 p = scan.point(u, v);
        const double noise = 3.0 * surfels.local_sigma_mm(tile_u, tile_v);
        double best = 1e300;
        for (int k = 0; k < count; ++k) {
          const Surface& s = surfaces[static_cast<std::size_t>(candidates[k] - 1)];
          // Where the sensor's waves exceed its noise, the support's own scatter says how far its pixels lie.
          const double waves = 3.0 * primitives.items[static_cast<std::size_t>(candidates[k] - 1)].rms_mm;
          // Along the ray the noise is sigma; along the normal it is seen at its cosine.
          const double distance = std::abs(s.distance(p)) / std::max(0.2, std::abs(s.normal(p).dot(p)) / p.z());
          if (distance > std::min(best, std::sqrt(noise * noise + waves * waves))) continue;
          best = distance;
          labels(u, v) = static_cast<std::uint16_t>(candidates[k]);
        }
      }
  });
  return labels;
}

std::vector<std::uint16_t> label_points(const Primitives& primitives, const Surfels& surfels) {
  TRIBIN_ASSERT(surfels.point_set != nullptr);
  std::vector<std::uint16_t> out(surfels.surfel_of_point.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<std::uint16_t>(primitives.label_of_surfel[surfels.surfel_of_point[i]]);
  return out;
}

}  // namespace tribin
