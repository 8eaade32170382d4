#pragma once

#include "tribin/core/image.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin::surfel_detail {

/// The paper's normals: depths smoothed by a Gaussian, a first normal from an N x N mask of the image, the neighbours
/// turned into its tangent plane by equation (1), averaged in N x N cells there, and the normals of triangles of
/// symmetric pairs of cells averaged, once more.
/// \source Barajas et al., section III-A, figure 2 (a), equation (1) as mended in pixel_normals.hpp.
Image<Vec3f> tangent_mask_normals(const Scan& scan, int window_px);

}  // namespace tribin::surfel_detail
