#pragma once

#include "tribin/core/image.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin {

enum class NormalMethod : std::uint8_t {
  inverse_depth,  ///< least squares in 1/z, windows that do not reach across depth edges, bends taken off
  tangent_mask    ///< the paper's: Gaussian smoothing, then an N x N mask in the tangent plane; no regard to edges
};

struct NormalOptions {
  NormalMethod method = NormalMethod::inverse_depth;
  int window_px =
      0;  ///< [px] odd, 3..31; 0 = 7 px, or as many more as bring the sigma of a normal below 1 deg, up to 15
};

/// Normal of every pixel with a depth: unit, camera frame, towards the camera. Zero where the pixel stands alone (no
/// two neighbours within the smallest window); NaN nowhere.
/// \param scan  any; holes are left out of the windows.
/// \throws Error bad_option for a window out of range.
/// \cost   1.3 Mpx, 7 px: inverse_depth 0.3 s, tangent_mask 2 s on 2 cores.
/// \source inverse_depth: ours: 1/z of a plane is affine in the pixel; sd of a slope sqrt(12) sigma / (p N^2), the
/// bound; tangent_mask: Barajas et
///         al., section III-A and equation (1), mended: k = n x e_z, normalised.
Image<Vec3f> pixel_normals(const Scan& scan, const NormalOptions& options = {});

}  // namespace tribin
