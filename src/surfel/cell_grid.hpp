#pragma once

#include <cstdint>
#include <vector>

#include "tribin/scan/scan.hpp"

namespace tribin::surfel_detail {

/// Planes in inverse depth, one per cell of N x N pixels, row-major. All in d = (1/z - 1/z_ref) z_ref^2 [mm]: near
/// z_ref, d is minus the depth's deviation, and float keeps 1e-4 mm of it. Planes are affine in d.
struct CellGrid {
  int cell_px = 0;
  int columns = 0;
  int rows = 0;
  double z_ref = 0;            ///< mm
  std::vector<float> mean;     ///< d at the centre of the cell
  std::vector<float> slope_u;  ///< of d per px
  std::vector<float> slope_v;
  std::vector<float> residual;        ///< rms of d about the plane
  std::vector<std::uint16_t> points;  ///< valid pixels; 0 = no cell

  std::size_t size() const { return mean.size(); }
  double center_u(int column) const { return column * cell_px + 0.5 * (cell_px - 1); }
  double center_v(int row) const { return row * cell_px + 0.5 * (cell_px - 1); }
  /// Depth of a value d [mm].
  double depth(double d) const { return 1.0 / (1.0 / z_ref + d / (z_ref * z_ref)); }
};

/// Fits every cell with >= 60 % valid pixels. Cells at the right and lower rim that would not be whole are left out.
/// \source W = 1/z of a plane is affine in the pixel: algorithms.md section 4.
CellGrid fit_cells(const Scan& scan, int cell_px);

}  // namespace tribin::surfel_detail
