#pragma once

#include <vector>

#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// What a sensor that draws steps of depth out (SceneDepth::edge_blur_px) would show along the outlines of a rendered
/// pose: the part's depth and, beyond it, the scan's, blurred into each other. The window is the render's with a margin
/// all around, cut at the image's border.
struct DrawnOut {
  int left = 0, top = 0;  ///< how many rendered pixels of margin
  int width = 0, height = 0;
  std::vector<float> z_mm;      ///< along outlines, both sides of them; 0 elsewhere
  std::vector<float> sigma_mm;  ///< of z there, beyond the noise: a step is drawn up to half of the blur off its place

  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
  }
};

/// \cost about 100 ns a pixel of the window.
/// \source ours.
DrawnOut draw_out(const SceneDepth& scene, const IndexRender& render);

}  // namespace tribin
