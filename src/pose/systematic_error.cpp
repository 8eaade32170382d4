#include "tribin/pose/systematic_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace tribin {
namespace {

constexpr int kTerms = 7;  // 1, x, y, xx, xy, yy of the relative error; a common offset

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Response = Eigen::Matrix<double, 6, kTerms>;

// A part is cut into 8 x 8 patches: mirrored light, a casting's skin and mixed pixels spoil pieces of about that size.
constexpr int kPatches = 8;

struct Patch {
  Vec6 pull = Vec6::Zero();  ///< of an error of 1 mm that its pixels have in common
  double sum = 0, variance = 0;
  int pixels = 0;
};

/// Mean square of what the pixels of a patch have in common beyond the noise [mm^2], by the median over the patches: of
/// a squared normal variable it is 0.455 of the mean.
double common_variance(const std::vector<Patch>& patches) {
  std::vector<double> excess;
  for (const Patch& p : patches)
    if (p.pixels >= 10) {
      const double mean = p.sum / p.pixels;
      excess.push_back(mean * mean - 0.455 * p.variance / p.pixels / p.pixels);
    }
  if (excess.size() < 8) return 0;
  std::nth_element(excess.begin(), excess.begin() + static_cast<long>(excess.size() / 2), excess.end());
  return std::max(0.0, excess[excess.size() / 2] / 0.455);
}

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
  thread_local IndexRender render;
  render_index(mesh, scene.camera, camera_from_part, step_px, render);
  if (render.width == 0) return Matrix6::Zero();
  const PinholeCamera& camera = scene.camera;
  const double independent =
      1 / std::max(1.0, correlation_inflation(scene.correlation_px) / (double(step_px) * step_px));
  Response response = Response::Zero();
  std::vector<Patch> patches(kPatches * kPatches);
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::int32_t k = render.triangle[render.index(i, j)];
      if (k < 0) continue;
      const int u = render.u0 + i * render.step, v = render.v0 + j * render.step;
      const float z = scene.z_mm(u, v);
      if (!(z > 0) || scene.near_break(u, v)) continue;
      const Eigen::Vector3d ray = camera.ray(u, v);
      const Eigen::Vector3d n = render.normal[static_cast<std::size_t>(k)].cast<double>();
      const double along = n.dot(ray);
      const double r = (z - 1.0 / render.inverse_z[render.index(i, j)]) * along;
      const double sigma = std::hypot(scene.sigma_mm(u, v) * along, cad_sigma_mm);
      if (std::abs(r) > 5 * sigma) continue;  // another surface: it does not hold the pose
      Vec6 jac;
      jac << n, (ray * z - Eigen::Vector3d(center)).cross(n);
      jac *= independent / (sigma * sigma);
      const double x = 2.0 * u / camera.width - 1, y = 2.0 * v / camera.height - 1;
      const std::array<double, kTerms> terms = {z, z * x, z * y, z * x * x, z * x * y, z * y * y, 1};
      for (int t = 0; t < kTerms; ++t) response.col(t) += jac * (along * terms[static_cast<std::size_t>(t)]);
      Patch& patch =
          patches[static_cast<std::size_t>(j * kPatches / render.height * kPatches + i * kPatches / render.width)];
      patch.pull += jac;
      patch.sum += r;
      patch.variance += sigma * sigma / independent;
      ++patch.pixels;
    }
  Mat6 out = response * variances(noise).asDiagonal() * response.transpose();
  const double common_mm2 = common_variance(patches);
  for (const Patch& patch : patches) out += common_mm2 * patch.pull * patch.pull.transpose();
  return Matrix6(out);
}

}  // namespace tribin
