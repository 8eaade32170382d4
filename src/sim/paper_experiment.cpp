#include "tribin/sim/paper_experiment.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "sim/random.hpp"
#include "tribin/core/error.hpp"
#include "tribin/sim/table_scene.hpp"

namespace tribin::sim {

PaperScene paper_scene(const Mesh& part, const std::vector<StableRest>& rests, int seed, const PaperOptions& options) {
  if (seed < 1)
    throw Error(ErrorCode::bad_option, "paper_scene: seed is " + std::to_string(seed) + "; wanted 1 or more");
  TRIBIN_ASSERT(!rests.empty());
  StructuredLight sensor;
  const double f = options.distance_mm / options.pitch_mm;
  sensor.camera = {1280, 1024, f, f, 639.5, 511.5};
  sensor.reference_mm = options.distance_mm;
  sensor.noise_mm = options.noise_mm;
  sensor.noise_correlation_px = options.noise_correlation_px;
  sensor.systematic = options.systematic;

  Random random(static_cast<std::uint64_t>(seed));
  PaperScene result;
  result.rest = (seed - 1) % static_cast<int>(rests.size());
  const StableRest& rest = rests[result.rest];
  const double yaw = random.uniform(0, 2 * kPi);
  result.tilt = random.uniform(0, options.max_tilt);
  const double azimuth = random.uniform(0, 2 * kPi);
  const double place_x = random.uniform(-1, 1), place_y = random.uniform(-1, 1);
  const Pose camera_from_table = camera_above(options.distance_mm, result.tilt, azimuth);
  // The draw covers as much of the table as leaves the part wholly in view: the reach shrinks until it is.
  for (double reach = 1;; reach -= 0.02) {
    const double x = reach * place_x * 640 * options.pitch_mm, y = reach * place_y * 512 * options.pitch_mm;
    result.camera_from_part = camera_from_table * placed(rest, yaw, x, y);
    const bool in_view = std::all_of(part.vertices.begin(), part.vertices.end(), [&](const Vec3f& v) {
      const Vec3 p = result.camera_from_part * Vec3(v.cast<double>());
      const Vec2 q = sensor.camera.project(p);
      return p.z() > 0 && q.x() > 5 && q.y() > 5 && q.x() < sensor.camera.width - 6 && q.y() < sensor.camera.height - 6;
    });
    if (in_view) break;
    if (reach <= 0)
      throw Error(ErrorCode::out_of_range,
                  part.name + ": too large to be seen whole from " + std::to_string(options.distance_mm) + " mm");
  }
  const Mesh table = table_mesh();
  result.simulated =
      simulate_scan({{&table, camera_from_table, 0.5, /*shine=*/0}, {&part, result.camera_from_part, 0.5}}, sensor,
                    mixed(static_cast<std::uint64_t>(seed)));
  return result;
}

PaperScene paper_scene(const Mesh& part, int seed, const PaperOptions& options) {
  return paper_scene(part, stable_rests(part), seed, options);
}

Matrix6 cramer_rao_bound(const SimulatedScan& simulated, int body, double correlation_px) {
  TRIBIN_ASSERT(body >= 0 && body < static_cast<int>(simulated.bodies.size()));
  const PinholeCamera& camera = simulated.scan.camera;
  const Vec3 origin = simulated.bodies[body].camera_from_body.translation();
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      if (simulated.body(u, v) != body || !std::isfinite(simulated.scan.z_mm(u, v))) continue;
      const Vec3 n = simulated.normal(u, v).cast<double>(), ray = camera.ray(u, v);
      const Vec3 p = ray * static_cast<double>(simulated.true_z(u, v));
      Eigen::Matrix<double, 6, 1> j;
      j << n, (p - origin).cross(n);
      j /= n.dot(ray) * simulated.sigma_mm(u, v);
      information += j * j.transpose();
    }
  // Millimetres and radians differ by the part's size: rank is judged on the information scaled to a unit diagonal.
  const Eigen::Matrix<double, 6, 1> scale = information.diagonal().cwiseSqrt();
  if (!(scale.minCoeff() > 0))
    throw Error(ErrorCode::too_little_data, "Cramer-Rao bound: no measured pixel shows the body");
  const Eigen::Matrix<double, 6, 6> scaled =
      scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(scaled);
  if (solver.eigenvalues()(0) < 1e-9)
    throw Error(ErrorCode::too_little_data, "Cramer-Rao bound: the pixels leave a direction of the pose free");
  const Eigen::Matrix<double, 6, 6> covariance =
      scale.cwiseInverse().asDiagonal() * scaled.inverse() * scale.cwiseInverse().asDiagonal();
  return covariance * std::max(1.0, 4 * kPi * correlation_px * correlation_px);
}

PoseBound pose_bound(const Matrix6& covariance, const Pose& camera_from_part, const Vec3& point) {
  const Vec3 arm = camera_from_part.linear() * point;
  Matrix3 minus_arm_cross;  // the point moves by dt + w x arm
  minus_arm_cross << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  Eigen::Matrix<double, 3, 6> j;
  j << Matrix3::Identity(), minus_arm_cross;
  return {std::sqrt((j * covariance * j.transpose()).trace()), std::sqrt(covariance.bottomRightCorner<3, 3>().trace())};
}

}  // namespace tribin::sim
