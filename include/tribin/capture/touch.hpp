#pragma once

#include <span>
#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"

/// The touch test: places that the vision predicted against the same places touched with the robot's tip.
/// Residuals of a hand-eye calibration only say that its data agree; this says whether the robot arrives.
namespace tribin {

/// One place, both in one frame (the robot's base).
struct TouchedPoint {
  std::string id;
  Vec3 predicted_mm = Vec3::Zero();
  Vec3 touched_mm = Vec3::Zero();
};

/// The errors in one part of the workspace.
struct TouchRegion {
  Vec3 min_mm = Vec3::Zero(), max_mm = Vec3::Zero();  ///< of the touched points in it
  std::vector<int> points;                            ///< indices, rising; never empty
  Vec3 mean_error_mm = Vec3::Zero();                  ///< touched minus predicted
  double rms_mm = 0;
};

struct TouchResult {
  std::vector<Vec3> error_mm;     ///< touched minus predicted, one a point
  double rms_mm = 0, max_mm = 0;  ///< of their lengths
  Vec3 mean_error_mm = Vec3::Zero();
  Pose touched_from_predicted = Pose::Identity();  ///< the rigid motion that fits best
  double rotation_rad = 0;                         ///< its angle
  std::vector<double> residual_mm;                 ///< what is left of each point after it
  double residual_rms_mm = 0;                      ///< not corrected for the six fitted numbers
  double residual_sigma_mm = 0;                    ///< of one axis of one point, corrected: sqrt(sum / (3 n - 6))
  double scale = 1, scale_sigma = 0;  ///< touched over predicted lengths: off 1 means the camera's own calibration
  bool rigid_error = false;  ///< the rigid part stands out of what is left (F test at 0.1 %): the hand-eye is off
  bool scale_error = false;  ///< scale stands out of its sigma by 4
  std::vector<TouchRegion>
      regions;  ///< the box of the points halved along each side that is long enough; occupied ones
};

/// \param points  3 or more, not on one line; 8 to 12 spread over the workspace are good.
/// \throws Error  too_little_data for fewer, or points on a line.
/// \source        rigid fit: Umeyama 1991 (Eigen); the scale is the least-squares one about the centres.
TouchResult evaluate_touch(std::span<const TouchedPoint> points);

}  // namespace tribin
