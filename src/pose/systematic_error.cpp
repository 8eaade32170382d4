#include "tribin/pose/systematic_error.hpp"

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

}  // namespace tribin
