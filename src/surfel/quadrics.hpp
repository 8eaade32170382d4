#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surfel/cell_grid.hpp"
#include "surfel/cell_noise.hpp"

namespace tribin::surfel_detail {

/// Half widths of the windows of cells that a quadric is fitted to, smallest first: 3, 5, 7 and 9 cells.
inline constexpr std::array<int, 4> kHalfWindows{1, 2, 3, 4};

/// d(i, j) = c0 + c1 i + c2 j + c3 i^2 + c4 i j + c5 j^2 about each cell's centre, i and j in cells: the largest window
/// that the noise lets pass.
struct Quadrics {
  std::array<std::vector<float>, 6> c;
  std::vector<std::uint8_t> half;  ///< half width of the window in cells; 0 = none passed
};

/// \param sigma_d  sd of d of one pixel at each cell, 0 where the cell is refused.
Quadrics fit_quadrics(const CellGrid& grid, const std::vector<float>& sigma_d, const CellNoise& noise);

/// Variances of c1, c3 and c4 of a window for unit noise of one pixel (white; correlated noise scales them).
struct QuadricVariance {
  double gradient, square, mixed;
};
QuadricVariance quadric_variance(int half, int cell_px);

}  // namespace tribin::surfel_detail
