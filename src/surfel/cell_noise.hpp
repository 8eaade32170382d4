#pragma once

#include "tribin/surfel/surfels.hpp"

namespace tribin::surfel_detail {

/// What noise of sd 1, correlated over c px, leaves in the plane fit of one N x N cell. Exact sums over the cell's
/// pixels.
struct CellNoise {
  double mean = 1;               ///< sd of the cell's mean
  double slope = 1;              ///< sd of the slope [1/px]
  double residual_quantile = 1;  ///< 30 % quantile of the residual rms over many cells
  double residual_limit = 2;     ///< residual rms that 1 noise cell in 5000 exceeds
  double information = 1;        ///< variance of a wide mean over the white-noise law of the cells' means: >= 1
};
CellNoise cell_noise(int cell_px, double correlation_px);

/// Share of neighbouring samples' variance that is common: correlation of noise at a distance [px].
double noise_correlation(double distance_px, double correlation_px);

/// Typical noise and correlation of a scan from third differences at lags 1 and 4, which no curvature reaches.
/// \source algorithms.md section 15, bet 6.
struct ThirdDifferences {
  double sigma_mm = 0;
  double correlation_px = 0;
};
ThirdDifferences noise_from_third_differences(const Scan& scan, const Image<float>& quantisation_steps);

/// The step between neighbouring depth values in each tile of kQuantisationTile^2 pixels [mm]; near 0 where depth is
/// not coarsely quantised. Structured-light and disparity cameras store steps that can exceed their noise.
inline constexpr int kQuantisationTile = 32;
Image<float> quantisation_steps(const Scan& scan);

}  // namespace tribin::surfel_detail
