#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/grasp/candidates.hpp"
#include "tribin/kinematics/inverse.hpp"
#include "tribin/recognition/instance.hpp"
#include "tribin/scan/scan.hpp"

/// From found parts to ranked grasps with their paths, and a reason for each one that was refused. All poses are in the
/// base's frame, z up.
namespace tribin::grasp {

/// A part that lies in the scene.
struct PartHere {
  const GraspPart* part = nullptr;
  int id = 0;  ///< Instance::id, carried to the answer
  Pose base_from_part = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< as Instance::covariance, along the axes of the base
  double score = 1;                      ///< probability that class and place are right
  double visible = 1;                    ///< share that the camera sees
  bool pick = true;                      ///< false: an obstacle only (its pose is undecided, say)
  /// Where it may be put down (poses of the part, any of them will do); empty = not checked.
  std::vector<Pose> base_from_placed;
};

/// The arm that picks. All pointers must be set.
struct ArmHere {
  const robot::RobotModel* robot = nullptr;
  const robot::Arm* arm = nullptr;
  double waist = 0;                   ///< [rad] where it stands
  std::optional<robot::Joints> from;  ///< where the arm comes from
};

/// All that grasps are planned by. A plain description: `scene_of` fills it from a work cell.
struct Scene {
  const Scan* scan = nullptr;  ///< none: nothing is known but the found parts
  Pose base_from_camera = Pose::Identity();
  double hand_eye_sigma_mm = 0, hand_eye_sigma_rad = 0;
  std::optional<CellBin> bin;
  std::vector<PartHere> parts;
  std::optional<ArmHere> arm;          ///< none: reach and links are not checked
  std::vector<Convex> obstacles;       ///< what stands in the cell: rack, camera, the other arm
  std::vector<Convex> on_flange;       ///< flange's frame: what the arm carries beside the gripper (a camera, a cable)
  std::optional<CellRange> workspace;  ///< where the TCP may be; none = anywhere
};

/// The scene of a cell: sigmas, bin, workspace, forbidden boxes and a fixed camera's ball as obstacles, found parts
/// with their covariance along the base's axes. Uncertain parts are obstacles. Parts without an entry in `known` are
/// left out. \param known  may be in any order; must outlive the scene, as must the scan.
Scene scene_of(const WorkCell& cell, const Scan& scan, const Pose& base_from_camera, const Instances& found,
               std::span<const GraspPart> known);

/// The hull of an arm at joint angles, base's frame: the file's capsules, or where it has none, a skeleton of capsules
/// along its links (a seventh of the arm's length thick).
std::vector<Convex> arm_bodies(const robot::RobotModel& robot, const robot::Arm& arm, double waist,
                               const robot::Joints& joints);

/// A pick that failed in a scan before: it is not tried again, and what lies near comes later.
struct FailedPick {
  Pose base_from_tcp = Pose::Identity();
  std::string gripper;
};

struct PlanOptions {
  std::optional<double> max_tilt_rad;  ///< of the approach to the vertical; the part's own maximum where that is less
  std::vector<std::string> grippers;   ///< names of those that may be used now; empty = all of the part's
  double approach_mm = 100;            ///< (0, 1000] least way from pre-pick to pick
  double retreat_mm = 100;             ///< (0, 1000] least way up with the part
  double clearance_mm =
      2;  ///< [0, 100] between what moves and what it must not touch; with 3 sigma as independent errors
  double limit_margin_rad = 2 * kDegree;  ///< of joints, see robot::Margins
  double singularity = 0.1;               ///< the same
  double min_score = 0;                   ///< of an instance, [0, 1]
  double max_covered = 0.1;               ///< share of a part, seen from above, that something may lie on, [0, 1]
  int looks = 200;                        ///< > 0, candidates looked at closely, a part and gripper
  int most_per_part = 3;                  ///< > 0, grasps given out, a part and gripper
  double push_mm = 40;                    ///< (0, 1000] length of a push
  std::vector<FailedPick> failed;
};

/// Why a grasp was refused. The order is that of the checks.
enum class Why {
  confidence,      ///< the part's score is too low
  covered,         ///< something lies on the part [share of its area seen from above]
  hold,            ///< force against weight [ratio]
  tried_before,    ///< this very grasp failed [mm from it]
  approach_angle,  ///< to the vertical [rad]
  stroke,          ///< the opening that it takes [mm]
  pose_sigma,      ///< 3 sigma of the place where the jaws close, against their room a side [mm]
  workspace,       ///< outside of it [mm]
  reach,           ///< no joint angles inside limits and margins, at one of the steps
  form,       ///< the arm cannot follow the path in one configuration [rad between neighbours; 0: its form bits change]
  bin,        ///< open gripper against the walls and floor [mm of gap]
  scan,       ///< against what was seen, and what lies behind it [mm]
  part,       ///< against another found part [mm]
  obstacle,   ///< against something that stands in the cell [mm]
  held_bin,   ///< the part in hand against the walls on its way out [mm]
  held_part,  ///< it would take another part along [mm]
  arm_bin,    ///< links against the walls [mm]
  arm_scan,   ///< links against what was seen [mm]
  arm_obstacle,  ///< links against what stands in the cell [mm]
  place,         ///< no place can be reached with it
};
inline constexpr int kWhys = 20;
/// The enumerator's own name: stable, programs compare it.
std::string_view name_of(Why why);

enum class Step { entry, pre_pick, pick, push, retreat };
std::string_view name_of(Step step);

/// A place on the path. Moves between neighbours are straight, in one configuration of the arm.
struct PathPoint {
  Step step = Step::pick;
  Pose base_from_tcp = Pose::Identity();
  robot::Joints joints{};  ///< where the scene has an arm
};

/// A factor of a score, in [0, 1].
struct Term {
  std::string name;
  double value = 1;
};

/// A grasp that passed all checks.
struct Grasp {
  int part = 0;  ///< index into Scene::parts
  int id = 0;    ///< PartHere::id
  std::string part_name, gripper, family;
  Pose part_from_tcp = Pose::Identity();
  double opening_before_mm = 0;  ///< of the jaws on the way in; 0 for cups and magnets
  double opening_mm = 0;         ///< where they hold: what a grip check should see
  double clearance_mm = 0;       ///< least gap on the way
  double sigma_mm = 0;           ///< of the place along the closing direction (cups: across their axis)
  /// pre_pick, pick, retreat; before them `entry`, where the straight way down to pre_pick begins above the bin. Tool
  /// and part are clear of the bin at the first and the last.
  std::vector<PathPoint> path;
  std::vector<Term> terms;
  double score = 0;  ///< the terms' product

  /// The place of a step. \return none where the path does not have it (only `entry` may miss)
  const PathPoint* at(Step step) const;
};

/// A candidate that was refused, by the first check that it failed.
struct RefusedGrasp {
  int part = 0;  ///< index into Scene::parts
  std::string gripper, family;
  Why why = Why::reach;
  double value = 0, limit = 0;  ///< seen and wanted, in the unit of the reason
  Pose base_from_tcp = Pose::Identity();
};

/// How often a reason was given.
struct WhyCount {
  Why why = Why::reach;
  int count = 0;
};

struct Plan {
  std::vector<Grasp> grasps;          ///< best first
  std::vector<RefusedGrasp> refused;  ///< in the order of parts, grippers and candidates
  std::vector<WhyCount> reasons;      ///< of the refused ones, most frequent first
  int not_looked_at = 0;              ///< candidates left when enough was found, or looked at in vain
  std::vector<std::string> warnings;
};

/// Plans grasps for all parts of a scene. The same scene gives the same bytes for any number of threads.
/// \throws Error bad_option for options out of range.
/// \cost   some 0.1 s of CPU time for 15 parts
Plan plan_grasps(const Scene& scene, const PlanOptions& options = {});

/// A push with the closed gripper: to free a part that no grasp takes.
struct Push {
  int part = 0;  ///< index into Scene::parts
  int id = 0;
  std::string part_name, gripper;
  double length_mm = 0;  ///< of the push
  /// pre_pick (above the bin), pick (beside the part), push (where it ends) and retreat (above the bin).
  std::vector<PathPoint> path;
  std::vector<Term> terms;
  double score = 0;
};

struct PushPlan {
  std::vector<Push> pushes;  ///< best first
  std::vector<RefusedGrasp> refused;
  std::vector<WhyCount> reasons;
};

/// Plans pushes with the closed gripper, upright, along the floor: beside the part at half its height, or near its top,
/// which turns it over. They lead towards the bin's middle, by `push_mm`, and are checked like grasps; what is in the
/// part's own way is not. Covered parts are pushed too.
/// \throws Error bad_option for options out of range.
PushPlan plan_pushes(const Scene& scene, const PlanOptions& options = {});

}  // namespace tribin::grasp
