#include "tribin/pose/systematic_error.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "inside_silhouette.hpp"
#include "tribin/pose/systematic_terms.hpp"

namespace tribin {
namespace {

using Response = Eigen::Matrix<double, 6, kSystematicTerms>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// A pixel that holds the pose: those of the information, no others. One more face would pull where nothing else holds.
struct HoldingPixel {
  Vec6 jacobian;
  double residual = 0;  ///< of the scan's point from the facet [mm]
  double along = 0;     ///< of the ray and the normal: turns z into the residual
  double variance = 1;  ///< of the residual [mm^2]
  double z = 0;         ///< measured
};

std::optional<HoldingPixel> holding_pixel(const IndexRender& render, const SceneDepth& scene, const Vec3& center,
                                          double cad_sigma_mm, int i, int j) {
  const std::size_t at = render.index(i, j);
  const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
  if (render.triangle[at] < 0) return {};
  const float z = scene.z_mm(u, v);
  if (!(z > 0) || scene.near_break(u, v) || !inside_silhouette(render, i, j)) return {};
  const Eigen::Vector3d ray = scene.camera.ray(u, v);
  const Eigen::Vector3d n = render.normal[static_cast<std::size_t>(render.triangle[at])].cast<double>();
  HoldingPixel out;
  out.along = n.dot(ray);
  out.residual = (z - 1.0 / render.inverse_z[at]) * out.along;
  const double sigma = std::hypot(scene.sigma_mm(u, v) * out.along, cad_sigma_mm);
  if (std::abs(out.residual) > 5 * sigma) return {};  // another surface
  out.jacobian << n, (ray * z - Eigen::Vector3d(center)).cross(n);
  out.variance = sigma * sigma;
  out.z = z;
  return out;
}

/// Share of the rendered pixels that tell something of their own.
double independent_share(const IndexRender& render, const SceneDepth& scene) {
  return 1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(render.step) * render.step));
}

}  // namespace

Matrix6 pull_of_systematic_errors(const IndexRender& render, const SceneDepth& scene, const NoiseProfile& noise,
                                  const Vec3& center, double cad_sigma_mm) {
  const SystematicVariances variance = systematic_variances(noise);
  if (variance.isZero()) return Matrix6::Zero();
  const PinholeCamera& camera = scene.camera;
  Response response = Response::Zero();
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const auto pixel = holding_pixel(render, scene, center, cad_sigma_mm, i, j);
      if (!pixel) continue;
      const auto terms = systematic_terms(camera, render.u0 + i * render.step, render.v0 + j * render.step, pixel->z);
      for (int t = 0; t < kSystematicTerms; ++t)
        response.col(t) += pixel->jacobian * (pixel->along * terms[static_cast<std::size_t>(t)] / pixel->variance);
    }
  response *= independent_share(render, scene);
  return Matrix6(response * variance.asDiagonal() * response.transpose());
}

Matrix6 pull_of_patches(const IndexRender& render, const SceneDepth& scene, const Vec3& center, double cad_sigma_mm) {
  constexpr double kPatches = 25;
  constexpr int kLeast = 12;  // twice the six numbers that the fit has taken from them
  const auto covered = std::count_if(render.triangle.begin(), render.triangle.end(), [](auto t) { return t >= 0; });
  const int patch = std::max(4, static_cast<int>(std::lround(std::sqrt(static_cast<double>(covered) / kPatches))));
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  int patches = 0;
  for (int j0 = 0; j0 < render.height; j0 += patch)
    for (int i0 = 0; i0 < render.width; i0 += patch) {
      Vec6 pull = Vec6::Zero();
      bool any = false;
      for (int j = j0; j < std::min(render.height, j0 + patch); ++j)
        for (int i = i0; i < std::min(render.width, i0 + patch); ++i) {
          const auto pixel = holding_pixel(render, scene, center, cad_sigma_mm, i, j);
          if (!pixel) continue;
          pull += pixel->jacobian * (pixel->residual / pixel->variance);
          any = true;
        }
      if (!any) continue;
      sum += pull * pull.transpose();
      ++patches;
    }
  if (patches < kLeast) return Matrix6::Zero();
  const double independent = independent_share(render, scene);
  return Matrix6(sum * (independent * independent * patches / (patches - 6.0)));
}

}  // namespace tribin
