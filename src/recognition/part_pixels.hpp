#pragma once

#include <vector>

#include "candidates.hpp"
#include "tribin/pose/index_render.hpp"
#include "tribin/recognition/instance.hpp"

// A found part compared with the scan pixel by pixel, for metrology: edges and what mixes there are left out.
namespace tribin {

struct PartPixels {
  IndexRender render;
  /// 1 where every pixel of the render that could mix with this one shows the same smooth piece of the surface.
  std::vector<std::uint8_t> inner;
  /// 1 where these pixels also belong to one and the same primitive.
  std::vector<std::uint8_t> inner_primitive;
  /// 1 where a mirror would show the camera another surface of the scan: light of that one may be mixed in.
  std::vector<std::uint8_t> mirrored;
  bool shiny = false;  ///< other surfaces' light shows on the parts of this scan
  int step = 1;

  int primitive(const Part& part, std::size_t k) const {
    const std::int32_t t = render.triangle[k];
    return t < 0 ? 0 : part.primitive_of_triangle[static_cast<std::size_t>(t)];
  }
};

/// Edges are left out as far as the pose may be off beside them, by the instance's covariance.
/// \cost one render of 20 000 pixels, and some 50 ns a pixel.
PartPixels compare_pixels(const Part& part, const SceneDepth& scene, const Instance& instance);

}  // namespace tribin
