#pragma once

#include <algorithm>
#include <cmath>

#include "tribin/surfel/surfels.hpp"

namespace tribin {

/// A scan prepared for verification and refinement: depth, its local noise, normals of cells, and where depth breaks.
struct SceneDepth {
  PinholeCamera camera;
  Image<float> z_mm;  ///< NaN = no measurement
  Image<std::uint8_t>
      near_break;            ///< 1 where a depth break or the border of a hole lies within one pixel: mixed pixels
  Image<Vec3f> cell_normal;  ///< towards the camera; zero where the cell has no surfel
  /// 1 where a cell belongs to a surface that is too large for the part looked for (a table, a wall): a face of the
  /// part that lies in it is seen nowhere. Empty = none.
  Image<std::uint8_t> background;
  /// 1 where a cell belongs to a floor: nothing lies behind it. Empty = none is known.
  Image<std::uint8_t> floor;
  int cell_px = 1;
  const Surfels* surfels = nullptr;
  double correlation_px = 0;
  double median_sigma_mm = 0;
  double edge_blur_px = 0;  ///< how wide the sensor draws steps of depth (pose/edge_blur.hpp); 0 = as sharp as the grid

  Image<std::uint8_t> mixed;  ///< 1 on steps that are drawn out (mixed_pixels); empty where they are sharp

  /// How many rendered pixels beside an outline the scan shows neither this side nor the other: two sd of the blur.
  int rim(int step_px) const { return static_cast<int>(std::ceil(2 * edge_blur_px / step_px)); }

  /// Local sd of z [mm] at pixel (u, v).
  float sigma_mm(int u, int v) const {
    const Image<float>& tiles = surfels->local_sigma_mm;
    const int i = std::min(u / (8 * cell_px), tiles.width - 1), j = std::min(v / (8 * cell_px), tiles.height - 1);
    return tiles(i, j);
  }
  /// Normal of the cell that holds pixel (u, v); zero where there is none.
  Vec3f normal(int u, int v) const {
    const int i = u / cell_px, j = v / cell_px;
    return cell_normal.contains(i, j) ? cell_normal(i, j) : Vec3f(Vec3f::Zero());
  }
  bool is_background(int u, int v) const { return flagged(background, u, v); }
  bool is_floor(int u, int v) const { return flagged(floor, u, v); }

 private:
  bool flagged(const Image<std::uint8_t>& cells, int u, int v) const {
    const int i = u / cell_px, j = v / cell_px;
    return cells.contains(i, j) && cells(i, j);
  }
};

/// \cost about 3 ns a pixel.
SceneDepth make_scene_depth(const Scan& scan, const Surfels& surfels);

/// How much a covariance from independent pixels must be inflated for noise correlated over c px: max(1, 4 pi c^2).
/// \source algorithm notes, section 1: the equivalent number of pixels of a Gaussian kernel of sd c.
double correlation_inflation(double correlation_px);

}  // namespace tribin
