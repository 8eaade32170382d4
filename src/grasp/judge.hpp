#pragma once

#include <optional>
#include <vector>

#include "arm_path.hpp"
#include "scene_facts.hpp"

// One candidate in a scene: its path, and the checks in their order.
namespace tribin::grasp {

/// Gaps that large are as good as any.
inline constexpr double kFarGap_mm = 10;

struct Refusal {
  Why why;
  double value = 0, limit = 0;
};

/// A candidate on its way through the checks; each adds what it learned.
struct Attempt {
  int part = 0;  ///< index into Scene::parts
  const Candidate* candidate = nullptr;
  const GripperShape* gripper = nullptr;
  const DepthSpace* around = nullptr;  ///< what was seen without the part itself; none where there is no scan
  Pose base_from_tcp = Pose::Identity();
  double tilt = 0, max_tilt = 0;  ///< [rad]
  double wider_mm = 0;            ///< a side, by which the jaws are to open farther than errors ask for
  double opening_before_mm = 0;
  double sigma_mm = 0, room_mm = 0;  ///< along the closing direction; what the jaws leave a side
  double hold = 1e300;               ///< force against weight
  double clearance_mm = 0;
  std::vector<PathPoint> path;
  std::vector<std::vector<Convex>> moves;  ///< the open tool, swept along each piece of the path
  std::optional<ArmPath> arm_path;
};

using Checked = std::optional<Refusal>;

/// What needs the candidate's place alone: cheap. \return the first check that it fails
Checked judge_place(const SceneFacts& facts, Attempt& attempt);
/// The path, the workspace, and the open tool against the bin.
Checked judge_walls(const SceneFacts& facts, Attempt& attempt);
/// Reach, and all that the tool, the part in hand and the arm could touch.
Checked judge_way(const SceneFacts& facts, Attempt& attempt);

/// The steps of both, which pushes take too. \param pick  which point of the path is the tightest
Checked check_workspace(const SceneFacts& facts, const Attempt& attempt);
Checked check_reach(const SceneFacts& facts, Attempt& attempt, std::size_t pick);
Checked check_tool_walls(const SceneFacts& facts, Attempt& attempt);
Checked check_tool_scene(const SceneFacts& facts, Attempt& attempt);

/// The lowest point of a part along a direction of the base [mm].
double lowest_of(const PartHere& here, const Vec3& up);

/// Straight in along the tool and straight up, from above the bin and back there.
void make_path(const SceneFacts& facts, Attempt& attempt);

/// The arm along its path against bin, obstacles and what was seen.
Checked check_arm(const SceneFacts& facts, Attempt& attempt);

/// The grasp of an attempt that passed, with its terms and score.
Grasp scored(const SceneFacts& facts, const Attempt& attempt);

}  // namespace tribin::grasp
