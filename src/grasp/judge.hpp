#pragma once

#include <optional>
#include <vector>

#include "arm_path.hpp"
#include "tribin/grasp/grasp.hpp"

// One candidate in a scene: its path, and the checks in their order.
namespace tribin::grasp {

/// What is the same for all candidates.
struct SceneFacts {
  const Scene* scene = nullptr;
  const PlanOptions* options = nullptr;
  std::vector<Convex> bin;
};
SceneFacts make_facts(const Scene& scene, const PlanOptions& options);

struct Refusal {
  Why why;
  double value = 0, limit = 0;
};

/// A candidate on its way through the checks; each adds what it learned.
struct Attempt {
  int part = 0;  ///< index into Scene::parts
  const Candidate* candidate = nullptr;
  const GripperShape* gripper = nullptr;
  Pose base_from_tcp = Pose::Identity();
  double tilt = 0, max_tilt = 0;  ///< [rad]
  double opening_before_mm = 0;
  double sigma_mm = 0, room_mm = 0;  ///< along the closing direction; what the jaws leave a side
  double hold = 1;                   ///< force against what is needed
  double clearance_mm = 0;
  std::vector<PathPoint> path;
  std::optional<ArmPath> arm_path;
};

/// The checks in their order. \return the first that it fails; none: it is a grasp
std::optional<Refusal> judge(const SceneFacts& facts, Attempt& attempt);

/// The grasp of an attempt that passed, with its terms and score.
Grasp scored(const SceneFacts& facts, const Attempt& attempt);

/// The sd of a point of a part along a unit direction, of its pose and of the hand-eye calibration [mm].
double sigma_along(const Scene& scene, const PartHere& part, const Vec3& base_point, const Vec3& direction);

}  // namespace tribin::grasp
