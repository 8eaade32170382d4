#pragma once

#include <Eigen/Core>
#include <vector>

#include "tribin/capture/rig.hpp"

/// Bundle adjustment of boards: all devices and all views at once.
namespace tribin::calibration_detail {

/// fx, fy, cx, cy, k1, k2, p1, p2, k3
using Intrinsics = Eigen::Matrix<double, 9, 1>;

/// A camera, or a projector. Priors are Gaussian, an sd of 0 means none.
struct Device {
  Intrinsics intrinsics = Intrinsics::Zero();
  Intrinsics prior_mean = Intrinsics::Zero(), prior_sd = Intrinsics::Zero();
  Pose rig_from_device = Pose::Identity();  ///< the first device's is held
  bool fixed = false;                       ///< neither lens nor pose moves
  double sigma = 1;                         ///< of one coordinate of a point [px]
};

/// What one device sees of the board in one view.
struct Sight {
  int device = 0, view = 0;
  std::vector<Vec3> point;  ///< on the board
  std::vector<Vec2> pixel;
  std::vector<char> used;  ///< 0: an outlier
};

struct Bundle {
  std::vector<Device> devices;
  std::vector<Pose> rig_from_board;  ///< one a view
  std::vector<char> view_used;
  std::vector<Sight> sights;
};

/// The pixel of a point before a device; NaN behind it.
Vec2 project(const Intrinsics& intrinsics, const Vec3& point);

/// Predicted minus seen, of each point of a sight [px].
std::vector<Vec2> residuals(const Bundle& bundle, const Sight& sight);

enum class Loss {
  squares,
  huber  ///< linear beyond 2.5 sigma: outliers pull with limited force
};

/// Moves all intrinsics, the devices' poses and the boards' poses to the least cost (Levenberg and Marquardt; the views
/// are eliminated by the Schur complement). Views not in use get their best pose for the devices as they come out.
/// \return the cost: squares in sigmas over all used points, and priors.
double refine(Bundle& bundle, Loss loss, int rounds = 60);

/// Covariance of all devices' parameters, 15 a device: intrinsics, then (dt mm, w rad) of rig_from_device in the rig's
/// axes, R_true = Exp(w) R; zero for the first device's pose. With the sigmas as they stand.
Eigen::MatrixXd covariance(const Bundle& bundle);

}  // namespace tribin::calibration_detail
