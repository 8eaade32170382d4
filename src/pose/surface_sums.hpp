#pragma once

#include <array>

#include "tribin/pose/index_render.hpp"
#include "tribin/pose/scene_depth.hpp"

namespace tribin {

/// The normal equations of a pose from the distances of scan points to the facets that their pixels see.
struct SurfaceSums {
  std::array<double, 21> h{};  ///< upper triangle, row by row, of (dt in mm, w in rad about the centre)
  std::array<double, 6> b{};
  double squares = 0, squares_sigma = 0, weight = 0;
  int pixels = 0;
  std::array<int, 200> residuals{};  ///< histogram of |residual| in tenths of sigma, for their median

  void add(const SurfaceSums& o) {
    for (std::size_t i = 0; i < h.size(); ++i) h[i] += o.h[i];
    for (std::size_t i = 0; i < b.size(); ++i) b[i] += o.b[i];
    squares += o.squares;
    squares_sigma += o.squares_sigma;
    weight += o.weight;
    pixels += o.pixels;
    for (std::size_t i = 0; i < residuals.size(); ++i) residuals[i] += o.residuals[i];
  }

  Matrix6 information() const;

  /// Robust sd of the residuals in sigmas: 1.48 times their median; 1 when the noise alone explains them.
  double spread() const {
    int all = 0, sum = 0;
    for (const int n : residuals) all += n;
    for (std::size_t i = 0; i < residuals.size(); ++i)
      if (2 * (sum += residuals[i]) > all) return 1.4826 * 0.1 * (static_cast<double>(i) + 0.5);
    return 1;
  }
};

/// \param center        in the camera frame [mm]; rotations turn about it.
/// \param scale_mm      of the kernel (Geman and McClure), at least `kernel_sigmas` times a point's sigma.
/// \param cad_sigma_mm  of the mesh about the part's surface, beside the scan's local sigma.
/// \param by_patches    points count only where at least half of the patch around them lies within the kernel.
/// \param final_pass    points that the kernel leaves a quarter of their weight count whole, others not at all.
/// \cost about 10 ns a pixel.
SurfaceSums surface_sums(const SceneDepth& scene, const IndexRender& render, const Eigen::Vector3d& center,
                         double scale_mm, double cad_sigma_mm, double kernel_sigmas, bool by_patches, bool final_pass);

}  // namespace tribin
