#pragma once

#include <array>
#include <cmath>

#include "tribin/pose/index_render.hpp"

namespace tribin {

/// No outline between pixel (i, j) and the one (di, dj) away, the part's own inner ones included.
inline bool same_surface(const IndexRender& r, int i, int j, int di, int dj, float jump) {
  const int ii = i + di, jj = j + dj;
  if (ii < 0 || jj < 0 || ii >= r.width || jj >= r.height) return false;
  const std::size_t n = r.index(ii, jj);
  return r.triangle[n] >= 0 && std::abs(r.inverse_z[n] - r.inverse_z[r.index(i, j)]) <= jump;
}

/// The outline is left out one rendered pixel wide: there the scan mixes two surfaces and the facet may be the wrong
/// one; where the sensor draws its edges wider, so wide.
/// \param rim  SceneDepth::rim of the render's step
inline bool inside_silhouette(const IndexRender& r, int i, int j, int rim) {
  constexpr std::array<std::array<int, 2>, 4> kAcross = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  constexpr std::array<std::array<int, 2>, 4> kAslant = {{{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
  const float jump = 0.004f * r.inverse_z[r.index(i, j)] * r.step;  // 0.4 % of the depth a pixel: an inner outline
  for (const auto& d : kAcross)
    if (!same_surface(r, i, j, d[0], d[1], jump)) return false;
  if (rim <= 1) return true;
  for (const auto& d : kAcross)
    if (!same_surface(r, i, j, rim * d[0], rim * d[1], rim * jump)) return false;
  const int aslant = (7 * rim + 5) / 10;
  for (const auto& d : kAslant)
    if (!same_surface(r, i, j, aslant * d[0], aslant * d[1], rim * jump)) return false;
  return true;
}

}  // namespace tribin
