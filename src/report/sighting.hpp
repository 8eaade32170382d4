#pragma once

#include <functional>

#include "report/canvas.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin::report {

/// The pixels, surfels and primitives of a scan that one instance explains (or all of them, for a segmentation alone).
struct Sighting {
  int u0 = 0, v0 = 0, u1 = 0, v1 = 0;  ///< rectangle of pixels, u1 and v1 one past the end
  Image<std::uint8_t> on_part;         ///< whole scan: 1 = on the part; empty = all pixels count
  std::vector<std::uint32_t> surfels;
  std::vector<int> primitives;  ///< places in Primitives::items with most of their surfels here, largest first
};

Sighting sighting_of(const Scan& scan, const Surfels& surfels, const Primitives& primitives, const Part& part,
                     const Pose& camera_from_part);
Sighting whole_scan(const Scan& scan, const Surfels& surfels, const Primitives& primitives);

/// How a pixel is drawn; Material::halo = left out.
struct PixelLook {
  Material material = Material::grey;
  std::uint8_t step = 0;
  float tint = 0;
  std::uint16_t id = 0;  ///< of the primitive shown, 0 = none
};

/// The scan inside a rectangle as triangles, every `stride` pixels; holes stay holes, depth edges are not bridged.
ShadedSurface surface_of(const Scan& scan, const Surfels& surfels, const Sighting& where, int stride,
                         const std::function<PixelLook(int u, int v)>& look);

}  // namespace tribin::report
