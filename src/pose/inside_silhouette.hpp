#pragma once

#include <cmath>

#include "tribin/pose/index_render.hpp"

namespace tribin {

/// The outline is left out one rendered pixel wide: there the scan mixes two surfaces and the facet may be the wrong
/// one.
inline bool inside_silhouette(const IndexRender& r, int i, int j) {
  if (i == 0 || j == 0 || i + 1 == r.width || j + 1 == r.height) return false;
  const std::size_t k = r.index(i, j);
  const float w = r.inverse_z[k];
  const float jump = 0.004f * w * r.step;  // 0.4 % of the depth a pixel: steeper is an inner outline
  for (const std::size_t n :
       {k - 1, k + 1, k - static_cast<std::size_t>(r.width), k + static_cast<std::size_t>(r.width)})
    if (r.triangle[n] < 0 || std::abs(r.inverse_z[n] - w) > jump) return false;
  return true;
}

}  // namespace tribin
