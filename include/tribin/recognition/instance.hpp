#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tribin/core/reason.hpp"
#include "tribin/recognition/quality.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {

/// A direction of the pose that the data holds badly, without being free by symmetry.
struct WeakDirection {
  Vector6 direction = Vector6::Zero();  ///< unit, (mm, rad * lever) as in Instance::covariance
  double sigma_mm = 0;
  double sigma = 0;  ///< [rad]
  std::string cure;  ///< what would fix it
};

/// A self-similar pose that the data does not settle.
struct Alternative {
  Pose camera_from_part = Pose::Identity();
  double probability = 0;
  std::string decided_by;  ///< the feature that would tell
};

/// A named test that a candidate was judged by: what was seen, what was wanted.
struct TestResult {
  std::string test;  ///< stable key, as in Reason::test
  double value = 0;
  double limit = 0;
  bool passed = false;
  bool at_least = false;  ///< the limit is the least that was wanted, not the most
};

/// One primitive of the part, measured in the scan without its nominal value.
struct Evidence {
  std::string primitive;  ///< e.g. "cylinder 3": type and id of the part's primitive
  PrimitiveType type = PrimitiveType::plane;
  int cad_primitive = 0;   ///< id in the part's model
  int scan_primitive = 0;  ///< id in the scan's segmentation; 0 = measured without one
  double visible_arc = 0;  ///< [rad] cylinders, cones
  int inliers = 0;         ///< pixels
  double rms_mm = 0;
  std::optional<double> radius_nominal_mm, radius_measured_mm, radius_sigma_mm;
  std::optional<double> offset_mm, offset_sigma_mm;  ///< planes, cones: measured minus nominal place along the normal
  std::vector<TestResult> tests;                     ///< where the method judges by named tests (paper_method)
};

/// A part found in the scan.
struct Instance {
  int id = 0;  ///< from 1, best first
  std::string part;
  double score = 0;             ///< probability that class and place are right
  double visible_fraction = 0;  ///< share of its silhouette that the camera sees
  std::optional<double> p_within_tolerance;
  Pose camera_from_part = Pose::Identity();
  Matrix6 covariance =
      Matrix6::Zero();  ///< order (dt in mm, w in rad): R_true = Exp(w) R, t_true = t + dt, camera axes
  std::vector<Vector6> free_directions;
  std::vector<WeakDirection> weak_directions;
  std::vector<Pose> equivalent_poses;
  std::vector<Alternative> alternatives;
  std::vector<Evidence> evidence;
  Quality quality;
};

/// A connected piece of the scan that neither a part nor the background explains, and that is large enough to be a
/// piece of a part.
struct UnexplainedRegion {
  Vec3 center_mm = Vec3::Zero();  ///< mean of its points, camera frame
  double volume_mm3 = 0;          ///< between what is seen of it and the bin's floor, or the plane that it lies on
  int pixels = 0;                 ///< measured ones
};

struct Instances {
  std::vector<Instance> items;
  /// Class and place are sure, but which of its self-similar poses it is in is less likely told than not, or the pose
  /// is not as exact as was asked for. Same fields; `alternatives` holds the other poses.
  std::vector<Instance> uncertain;
  std::vector<Reason> rejected;
  bool time_limit = false;                     ///< the time ran out before all that is left was looked at
  std::vector<UnexplainedRegion> unexplained;  ///< largest volume first; empty = nothing of a part's size is left
  int work_done = 0;                           ///< units of the search: a run with this work_limit ends as this one
};

}  // namespace tribin
