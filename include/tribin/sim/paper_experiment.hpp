#pragma once

#include <cstdint>
#include <vector>

#include "tribin/sim/stable_rests.hpp"
#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// The experiment of the paper's section VI, simulated: one alternator on a table, the camera at 800 mm.
struct PaperOptions {
  double noise_mm = 0.1;            ///< sd of z on a facing surface at 800 mm
  double noise_correlation_px = 1;  ///< sd of the Gaussian that correlates it
  double systematic = 0;            ///< relative depth error over the image
  double distance_mm = 800;
  double pitch_mm = 0.5;  ///< a pixel on the table
  double max_tilt = 20 * kDegree;
};

/// One pose of the experiment: the scan and all that is true about it.
struct PaperScene {
  SimulatedScan simulated;  ///< body 0 is the table, body 1 the part
  Pose camera_from_part = Pose::Identity();
  int rest = 0;     ///< which of the stable rests
  double tilt = 0;  ///< of the camera [rad]
  const Scan& scan() const { return simulated.scan; }
};

/// Pose number `seed` (1, 2, ...): the part's stable rests in turn, most probable first; yaw, place and tilt drawn by
/// the seed, the part wholly in view. None is left out. 1280 x 1024 pixels.
/// \param rests  of the part, by stable_rests(); give them once for all seeds.
PaperScene paper_scene(const Mesh& part, const std::vector<StableRest>& rests, int seed,
                       const PaperOptions& options = {});
PaperScene paper_scene(const Mesh& part, int seed, const PaperOptions& options = {});

/// The smallest covariance that any unbiased estimate of the pose can have from these pixels: order (dt in mm, w in
/// rad), R' = Exp(w) R, t' = t + dt, camera axes. Only measured pixels whose centre ray meets the body count; outlines
/// are not used.
/// \param body            index into simulated.bodies.
/// \param correlation_px  sd of the Gaussian that correlates the noise; inflates the covariance by max(1, 4 pi c^2).
/// \throws Error too_little_data when the pixels leave a direction free (a part of revolution).
/// \source information J^T J / sigma_z^2 with J = [n, (p - t) x n] / (n . ray): a pixel's depth against the pose.
Matrix6 cramer_rao_bound(const SimulatedScan& simulated, int body, double correlation_px);

/// A bound in two numbers, the norms of the standard deviations; 0 = not known.
struct PoseBound {
  double translation_mm = 0;  ///< of the point
  double rotation = 0;        ///< [rad]
};
/// \param point  part frame: the centre of its box, mostly.
PoseBound pose_bound(const Matrix6& covariance, const Pose& camera_from_part, const Vec3& point);

}  // namespace tribin::sim
