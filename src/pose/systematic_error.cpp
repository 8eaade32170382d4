#include "tribin/pose/systematic_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "inside_silhouette.hpp"

namespace tribin {
namespace {

constexpr int kTerms = 7;  // 1, x, y, xx, xy, yy of the relative error; a common offset

using Response = Eigen::Matrix<double, 6, kTerms>;

/// sd of the coefficients. A quadratic with six equal ones has mean square 1 + 1/3 + 1/3 + 1/5 + 1/9 + 1/5 of theirs
/// over the image.
Eigen::Matrix<double, kTerms, 1> variances(const NoiseProfile& noise) {
  constexpr double kMeanSquare = 1 + 2.0 / 3 + 2.0 / 5 + 1.0 / 9;
  Eigen::Matrix<double, kTerms, 1> v;
  v.setConstant(noise.shape_error * noise.shape_error / kMeanSquare);
  v[0] += noise.scale_error * noise.scale_error;
  v[kTerms - 1] = noise.offset_mm * noise.offset_mm;
  return v;
}

}  // namespace

Matrix6 pull_of_systematic_errors(const RenderMesh& mesh, const SceneDepth& scene, const Pose& camera_from_part,
                                  const NoiseProfile& noise, const Vec3& center, int step_px, double cad_sigma_mm) {
  const Eigen::Matrix<double, kTerms, 1> variance = variances(noise);
  if (variance.isZero()) return Matrix6::Zero();
  thread_local IndexRender render;
  render_index(mesh, scene.camera, camera_from_part, step_px, render);
  const PinholeCamera& camera = scene.camera;
  Response response = Response::Zero();
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t k = render.triangle[render.index(i, j)];
      if (k < 0) continue;
      const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
      const float z = scene.z_mm(u, v);
      // The pixels of the information, no others: one more face would pull where nothing else holds.
      if (!(z > 0) || scene.near_break(u, v) || !inside_silhouette(render, i, j)) continue;
      const Eigen::Vector3d ray = camera.ray(u, v);
      const Eigen::Vector3d n = render.normal[static_cast<std::size_t>(k)].cast<double>();
      const double along = n.dot(ray);
      const double r = (z - 1.0 / render.inverse_z[render.index(i, j)]) * along;
      const double sigma = std::hypot(scene.sigma_mm(u, v) * along, cad_sigma_mm);
      if (std::abs(r) > 5 * sigma) continue;  // another surface: it does not hold the pose
      Eigen::Matrix<double, 6, 1> jac;
      jac << n, (ray * z - Eigen::Vector3d(center)).cross(n);
      const double x = 2.0 * u / camera.width - 1, y = 2.0 * v / camera.height - 1;
      const std::array<double, kTerms> terms = {z, z * x, z * y, z * x * x, z * x * y, z * y * y, 1};
      for (int t = 0; t < kTerms; ++t)
        response.col(t) += jac * (along * terms[static_cast<std::size_t>(t)] / (sigma * sigma));
    }
  const double independent =
      1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(step_px) * step_px));
  response *= independent;
  return Matrix6(response * variance.asDiagonal() * response.transpose());
}

Matrix6 pull_of_patches(const RenderMesh& mesh, const SceneDepth& scene, const Pose& camera_from_part,
                        const Vec3& center, int step_px, double cad_sigma_mm) {
  constexpr double kPatches = 25;
  constexpr int kLeast = 12;  // twice the six numbers that the fit has taken from them
  thread_local IndexRender render;
  render_index(mesh, scene.camera, camera_from_part, step_px, render);
  const auto covered = std::count_if(render.triangle.begin(), render.triangle.end(), [](auto t) { return t >= 0; });
  const int patch = std::max(4, static_cast<int>(std::lround(std::sqrt(static_cast<double>(covered) / kPatches))));
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  int patches = 0;
  for (int j0 = 0; j0 < render.height; j0 += patch)
    for (int i0 = 0; i0 < render.width; i0 += patch) {
      Vec6 pull = Vec6::Zero();
      int n = 0;
      for (int j = j0; j < std::min(render.height, j0 + patch); ++j)
        for (int i = i0; i < std::min(render.width, i0 + patch); ++i) {
          const std::size_t k = render.index(i, j);
          const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
          const float z = scene.z_mm(u, v);
          if (render.triangle[k] < 0 || !(z > 0) || scene.near_break(u, v) || !inside_silhouette(render, i, j))
            continue;
          const Eigen::Vector3d ray = scene.camera.ray(u, v);
          const Eigen::Vector3d normal = render.normal[static_cast<std::size_t>(render.triangle[k])].cast<double>();
          const double along = normal.dot(ray);
          const double r = (z - 1.0 / render.inverse_z[k]) * along;
          const double sigma = std::hypot(scene.sigma_mm(u, v) * along, cad_sigma_mm);
          if (std::abs(r) > 5 * sigma) continue;  // another surface: it does not hold the pose
          Vec6 jac;
          jac << normal, (ray * z - Eigen::Vector3d(center)).cross(normal);
          pull += jac * (r / (sigma * sigma));
          ++n;
        }
      if (n == 0) continue;
      sum += pull * pull.transpose();
      ++patches;
    }
  if (patches < kLeast) return Matrix6::Zero();
  const double independent =
      1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(step_px) * step_px));
  return Matrix6(sum * (independent * independent * patches / (patches - 6.0)));
}

}  // namespace tribin
