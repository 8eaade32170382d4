#include "tribin/pose/systematic_error.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "inside_silhouette.hpp"
#include "tribin/pose/systematic_terms.hpp"

namespace tribin {
namespace {

using Response = Eigen::Matrix<double, 6, kSystematicTerms>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// A measured pixel inside of the part.
struct SeenPixel {
  Vec6 jacobian;
  double residual = 0;  ///< of the scan's point from the facet [mm]
  double along = 0;     ///< of the ray and the normal: turns z into the residual
  double variance = 1;  ///< of the residual [mm^2]
  double z = 0;         ///< measured
  bool fits = false;    ///< else it is of another surface
};

std::optional<SeenPixel> seen_pixel(const IndexRender& render, const SceneDepth& scene, const Vec3& center,
                                    double cad_sigma_mm, int i, int j) {
  const std::size_t at = render.index(i, j);
  const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
  if (render.triangle[at] < 0) return {};
  const float z = scene.z_mm(u, v);
  if (!(z > 0) || scene.near_break(u, v) || !inside_silhouette(render, i, j, scene.rim(render.step))) return {};
  const Eigen::Vector3d ray = scene.camera.ray(u, v);
  const Eigen::Vector3d n = render.normal[static_cast<std::size_t>(render.triangle[at])].cast<double>();
  SeenPixel out;
  out.along = n.dot(ray);
  out.residual = (z - 1.0 / render.inverse_z[at]) * out.along;
  const double sigma = std::hypot(scene.sigma_mm(u, v) * out.along, cad_sigma_mm);
  out.fits = std::abs(out.residual) <= 5 * sigma;
  out.jacobian << n, (ray * z - Eigen::Vector3d(center)).cross(n);
  out.variance = sigma * sigma;
  out.z = z;
  return out;
}

/// Share of the rendered pixels that tell something of their own.
double independent_share(const IndexRender& render, const SceneDepth& scene) {
  return 1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(render.step) * render.step));
}

/// Which of 125 directions: normals of one differ by 30 deg or so.
int direction_of(const Vec6& jacobian) {
  const auto level = [](double x) { return static_cast<int>(2 * x + 2.5); };  // 0 to 4
  return (level(jacobian[0]) * 5 + level(jacobian[1])) * 5 + level(jacobian[2]);
}

/// What is gathered of a patch, pixel by pixel.
struct Sums {
  Vec6 pull = Vec6::Zero();
  Response response = Response::Zero();
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double weight = 0, residual = 0, steepness = 0;
  int all = 0, fit = 0;
};

}  // namespace

CommonErrors common_errors(const IndexRender& render, const SceneDepth& scene, const NoiseProfile& noise,
                           const Vec3& center, double cad_sigma_mm) {
  constexpr double kPatches = 36;
  // Fewer pixels, or fewer than half of what should fit, hold nothing: they fit by chance, as in surface_sums.
  constexpr int kLeast = 8;
  // What a good calibration of a camera leaves sideways, and the raster over a patch.
  constexpr double kLateralPx = 0.03;
  const PinholeCamera& camera = scene.camera;
  const double independent = independent_share(render, scene), pixel_mm = center.z() / camera.fx;
  const auto covered = std::count_if(render.triangle.begin(), render.triangle.end(), [](auto t) { return t >= 0; });
  const int side = std::max(4, static_cast<int>(std::lround(std::sqrt(static_cast<double>(covered) / kPatches))));
  CommonErrors out;
  Response response = Response::Zero();
  for (int j0 = 0; j0 < render.height; j0 += side)
    for (int i0 = 0; i0 < render.width; i0 += side) {
      std::map<int, Sums> of_direction;
      for (int j = j0; j < std::min(render.height, j0 + side); ++j)
        for (int i = i0; i < std::min(render.width, i0 + side); ++i) {
          const auto pixel = seen_pixel(render, scene, center, cad_sigma_mm, i, j);
          if (!pixel) continue;
          Sums& sums = of_direction[direction_of(pixel->jacobian)];
          ++sums.all;
          if (!pixel->fits) continue;
          ++sums.fit;
          const double weight = independent / pixel->variance;
          const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
          const auto terms = systematic_terms(camera, u, v, pixel->z);
          sums.pull += pixel->jacobian * weight;
          for (int t = 0; t < kSystematicTerms; ++t)
            sums.response.col(t) += pixel->jacobian * (weight * pixel->along * terms[static_cast<std::size_t>(t)]);
          sums.weight += weight;
          sums.residual += weight * pixel->residual;
          sums.steepness += 1 - std::min(1.0, pixel->along * pixel->along);
          sums.place += Eigen::Vector2d(u, v);
        }
      for (const auto& [direction, sums] : of_direction) {
        if (sums.fit < kLeast || 2 * sums.fit < sums.all) continue;
        response += sums.response;
        const double lateral_mm = kLateralPx * pixel_mm;
        out.patches.push_back({Vector6(sums.pull), sums.weight, sums.residual / sums.weight,
                               Vec2(sums.place * (pixel_mm / sums.fit)),
                               lateral_mm * lateral_mm * sums.steepness / sums.fit, direction});
      }
    }
  out.systematic = Matrix6(response * systematic_variances(noise).asDiagonal() * response.transpose());
  return out;
}

FieldVariance field_variance(std::span<const ErrorPatch> patches, const Matrix6& held, int held_directions) {
  // m = (I - A H^-1 G) f: what the fit leaves of the errors f of the patches.
  const auto n = static_cast<Eigen::Index>(patches.size());
  Eigen::VectorXd left_of_field(n), left_of_noise(n), residual2(n), noise(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const ErrorPatch& patch = patches[static_cast<std::size_t>(a)];
    const Vec6 moved = Eigen::Matrix<double, 6, 6>(held) * Vec6(patch.pull) / patch.weight;
    double field = 0, by_noise = 0;
    for (Eigen::Index b = 0; b < n; ++b) {
      const ErrorPatch& other = patches[static_cast<std::size_t>(b)];
      const double m = (a == b ? 1.0 : 0.0) - moved.dot(Vec6(other.pull));
      field += m * m;
      by_noise += m * m / other.weight;
    }
    left_of_field[a] = field;
    left_of_noise[a] = by_noise;
    residual2[a] = patch.residual_mm * patch.residual_mm;
    noise[a] = 1 / patch.weight;
  }
  FieldVariance out;
  for (int pass = 0; pass < 4; ++pass) {
    const Eigen::ArrayXd weights = (noise.array() + out.mm2).square().inverse();
    const Eigen::ArrayXd told = weights * left_of_field.array();
    const double sum = told.sum();
    if (!(sum > 0)) return {};
    out.mm2 = std::max(0.0, (weights * (residual2 - left_of_noise).array()).sum() / sum);
    out.patches = std::max(0.0, sum * sum / told.square().sum() - held_directions);
  }
  return out;
}

Matrix6 pull_of_field(std::span<const ErrorPatch> patches, double variance_mm2, double correlation_mm) {
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  for (std::size_t a = 0; a < patches.size(); ++a) {
    const ErrorPatch& patch = patches[a];
    const Vec6 pull = patch.pull;
    const double shown = std::max(0.0, patch.residual_mm * patch.residual_mm - 1 / patch.weight);
    Vec6 with_others = pull * (variance_mm2 + patch.lateral_mm2 + shown);
    for (std::size_t b = 0; b < patches.size(); ++b)
      if (b != a && patches[b].direction == patch.direction)
        with_others += Vec6(patches[b].pull) *
                       (variance_mm2 * std::exp(-(patches[b].place_mm - patch.place_mm).norm() / correlation_mm));
    sum += pull * with_others.transpose();
  }
  return Matrix6(0.5 * (sum + sum.transpose()));
}

}  // namespace tribin
