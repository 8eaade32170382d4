#pragma once

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "analytic_scan.hpp"
#include "tribin/cad/mesh.hpp"
#include "tribin/pose/index_render.hpp"

namespace tribin::test {

/// A scan of meshes at known poses above a table (a plane n . p = rho, n towards the camera), with correlated noise. No
/// shadow, no drop-out: what is measured is the method, not the sensor; tribin::sim has the sensor.
inline Scan posed_scan(const std::vector<std::pair<const Mesh*, Pose>>& things, const Vec3& table_normal,
                       double table_rho, double sigma_mm, double correlation_px, unsigned seed, int width = 640,
                       int height = 512) {
  Scan scan;
  scan.camera = {width, height, 1.4 * width, 1.4 * width, 0.5 * (width - 1), 0.5 * (height - 1)};
  scan.z_mm = Image<float>(width, height, std::numeric_limits<float>::quiet_NaN());
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      scan.z_mm(u, v) = static_cast<float>(table_rho / table_normal.dot(scan.camera.ray(u, v)));
  for (const auto& [mesh, pose] : things) {
    IndexRender render;
    render_index(make_render_mesh(*mesh), scan.camera, pose, 1, render);
    for (int j = 0; j < render.height; ++j)
      for (int i = 0; i < render.width; ++i)
        if (render.triangle[render.index(i, j)] >= 0) {
          float& z = scan.z_mm(render.u0 + i, render.v0 + j);
          z = std::min(z, 1 / render.inverse_z[render.index(i, j)]);
        }
  }
  const std::vector<double> noise = correlated_noise(width, height, correlation_px, seed);
  for (std::size_t i = 0; i < scan.z_mm.size(); ++i) scan.z_mm.data[i] += static_cast<float>(sigma_mm * noise[i]);
  return scan;
}

/// As stereo over windows draws it: smoothed in depth. The border stays as it is.
inline void draw_steps_out(Image<float>& z, double sd) {
  const int reach = static_cast<int>(std::ceil(3 * sd));
  for (const bool along_rows : {true, false}) {
    const Image<float> from = z;
    for (int v = 0; v < z.height; ++v)
      for (int u = 0; u < z.width; ++u) {
        double sum = 0, weights = 0;
        for (int k = -reach; k <= reach; ++k) {
          const int uu = along_rows ? u + k : u, vv = along_rows ? v : v + k;
          if (!from.contains(uu, vv)) continue;
          const double w = sd > 0 ? std::exp(-0.5 * k * k / (sd * sd)) : 1;
          sum += w * from(uu, vv);
          weights += w;
        }
        z(u, v) = static_cast<float>(sum / weights);
      }
  }
}

/// A pose at a depth, turned by a seeded random rotation.
inline Pose random_pose(double depth_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
  Pose pose = Pose::Identity();
  pose.linear() = q.normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(10 * normal(random), 10 * normal(random), depth_mm);
  return pose;
}

}  // namespace tribin::test
