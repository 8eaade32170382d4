#pragma once

#include <array>

#include "tribin/scan/scan.hpp"

// Errors of the sensor that are common to many pixels, as parameters: relative error of depth as a quadratic over the
// image (coordinates in [-1, 1]), with a scale of the whole scan in its constant, and a common offset.
namespace tribin {

constexpr int kSystematicTerms = 7;  // 1, x, y, xx, xy, yy of the relative error; a common offset
using SystematicVariances = Eigen::Matrix<double, kSystematicTerms, 1>;

/// Variances of the coefficients. A quadratic with six equal ones has mean square 1 + 1/3 + 1/3 + 1/5 + 1/9 + 1/5 of
/// theirs over the image.
inline SystematicVariances systematic_variances(const NoiseProfile& noise) {
  constexpr double kMeanSquare = 1 + 2.0 / 3 + 2.0 / 5 + 1.0 / 9;
  SystematicVariances v;
  v.setConstant(noise.shape_error * noise.shape_error / kMeanSquare);
  v[0] += noise.scale_error * noise.scale_error;
  v[kSystematicTerms - 1] = noise.offset_mm * noise.offset_mm;
  return v;
}

/// How the depth z [mm] measured at pixel (u, v) answers to each coefficient.
inline std::array<double, kSystematicTerms> systematic_terms(const PinholeCamera& camera, int u, int v, double z) {
  const double x = 2.0 * u / camera.width - 1, y = 2.0 * v / camera.height - 1;
  return {z, z * x, z * y, z * x * x, z * x * y, z * y * y, 1};
}

}  // namespace tribin
