#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"

/// Robot arms as geometry: what a robot file says, and where an arm stands at given joint angles.
///
/// Joint angles are the maker's own (zeros and signs as the pendant shows them), in radians, from base to tool. An
/// arm's frame is the foot of a six-axis arm, and the centre of the shoulder of a seven-axis one, z along the first
/// axis.
namespace tribin::robot {

inline constexpr int kMaxJoints = 7;
/// S L U R B T, or S L E U R B T: as they stand in the chain. Six-axis arms leave the last one at 0.
using Joints = std::array<double, kMaxJoints>;

struct JointRange {
  std::string name;           ///< "S", "L", ...
  double min = -kPi;          ///< [rad], may be beyond half a turn
  double max = kPi;           ///< [rad]
  double max_speed = 0;       ///< [rad/s]
  double sign = 1;            ///< shown = sign (chain + offset)
  double offset = 0;          ///< [rad]
  double pulses_per_deg = 0;  ///< 0 = the file does not say
};

enum class ArmKind {
  spherical_wrist_6,  ///< three axes that place the wrist, three that meet in it
  srs_7,              ///< a shoulder, an elbow and a wrist; axes of shoulder and wrist meet
};

/// Six axes: the seven lengths of a spherical-wrist arm [mm].
/// \source Brandstoetter, Angerer, Hofbaur, "An analytical solution of the inverse kinematics problem of industrial
///         serial manipulators with an ortho-parallel basis and a spherical wrist" (2014); design page 4.1.
struct OrthoParallel {
  double a1 = 0, a2 = 0, b = 0, c1 = 0, c2 = 0, c3 = 0, c4 = 0;
};

/// Seven axes: shoulder to elbow, elbow to wrist, wrist to flange [mm].
struct ShoulderElbowWrist {
  double upper = 0, fore = 0, wrist = 0;
};

/// A piece of an arm's hull, in the frame that turns with joint `link` (0 = the arm's own, unmoved frame).
struct LinkCapsule {
  int link = 0;
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< [mm]
  double radius = 0;                            ///< [mm]
};

struct Arm {
  std::string name;
  ArmKind kind = ArmKind::spherical_wrist_6;
  OrthoParallel six;
  ShoulderElbowWrist seven;
  std::vector<JointRange> joints;          ///< 6 or 7
  Pose mount_from_arm = Pose::Identity();  ///< mount: the waist's frame where there is one, else the robot's base
  Vec3 elbow_side = Vec3::Zero();     ///< unit, arm frame: where the elbow is best kept; 0 = anywhere. Seven axes only
  std::vector<LinkCapsule> capsules;  ///< may be empty: the file does not say
  int axes() const { return kind == ArmKind::srs_7 ? 7 : 6; }
};

/// The turning waist of a dual-arm robot, which carries all its arms.
struct Waist {
  Pose base_from_waist = Pose::Identity();  ///< at angle 0; it turns about z
  JointRange range;
};

struct RobotModel {
  std::string name;
  std::string source;                ///< where its numbers come from
  std::vector<std::string> assumed;  ///< what in the file is not the maker's word
  std::optional<Waist> waist;
  std::vector<Arm> arms;
};

/// The arm called so.
/// \throws Error bad_input, naming the arms that there are.
const Arm& arm_called(const RobotModel& robot, const std::string& name);

/// Where the arm's frame stands at an angle of the waist [rad]; robots without a waist take no notice of it.
Pose base_from_arm(const RobotModel& robot, const Arm& arm, double waist = 0);

/// The frames that turn with each joint: [0] the arm's own, [i] after joint i, the last one the flange.
struct LinkFrames {
  int count = 0;
  std::array<Pose, kMaxJoints + 1> arm_from_link;
};
LinkFrames link_frames(const Arm& arm, const Joints& joints);

/// \cost some 0.2 us
Pose arm_from_flange(const Arm& arm, const Joints& joints);

/// How far joints are from trouble.
struct Margins {
  double limit = 0;        ///< [rad] to the nearest limit; < 0: beyond it
  double singularity = 0;  ///< smallest |sin| of wrist, elbow and shoulder: 0 = an axis has no say there
};
Margins margins(const Arm& arm, const Joints& joints);

/// The time that all joints take together at their greatest speeds [s].
double travel_time_s(const Arm& arm, const Joints& from, const Joints& to);

/// The maker's six form bits ("type"), bit 0 lowest: no flip, lower arm, back, |R| >= 180, |T| >= 180, |S| >= 180 deg.
/// A seven-axis arm takes the same words: flip from R, lower from the side to which the elbow bends, back from L < 0.
int form_bits(const Arm& arm, const Joints& joints);

/// As controllers order them: S L U R B T, then E of a seven-axis arm; and back.
Joints to_controller_order(const Arm& arm, const Joints& joints);
Joints from_controller_order(const Arm& arm, const Joints& joints);

/// \throws Error bad_input where the robot's file gives no pulses per degree.
std::vector<long> pulses_from_joints(const Arm& arm, const Joints& joints);
Joints joints_from_pulses(const Arm& arm, const std::vector<long>& pulses);

}  // namespace tribin::robot
