#include <algorithm>
#include <cmath>

#include "tribin/grasp/grasp.hpp"

namespace tribin::grasp {
namespace {

Matrix6 turned(const Matrix6& covariance, const Matrix3& base_from_camera) {
  Matrix6 turn = Matrix6::Zero();
  turn.topLeftCorner<3, 3>() = base_from_camera;
  turn.bottomRightCorner<3, 3>() = base_from_camera;
  return turn * covariance * turn.transpose();
}

void add_parts(Scene& scene, const std::vector<Instance>& items, bool pick, std::span<const GraspPart> known) {
  for (const Instance& item : items) {
    const auto of_class =
        std::find_if(known.begin(), known.end(), [&](const GraspPart& part) { return part.part->name == item.part; });
    if (of_class == known.end()) continue;
    PartHere here;
    here.part = &*of_class;
    here.id = item.id;
    here.base_from_part = scene.base_from_camera * item.camera_from_part;
    here.covariance = turned(item.covariance, scene.base_from_camera.linear());
    here.score = item.score;
    here.visible = item.visible_fraction;
    here.pick = pick;
    scene.parts.push_back(std::move(here));
  }
}

}  // namespace

Scene scene_of(const WorkCell& cell, const Scan& scan, const Pose& base_from_camera, const Instances& found,
               std::span<const GraspPart> known) {
  Scene scene;
  scene.scan = &scan;
  scene.base_from_camera = base_from_camera;
  scene.hand_eye_sigma_mm = cell.hand_eye.sigma_mm;
  scene.hand_eye_sigma_rad = cell.hand_eye.sigma_rad;
  scene.bin = cell.bin;
  scene.workspace = cell.safety.workspace_mm;
  for (const CellRange& range : cell.safety.forbidden_mm) {
    Pose pose = Pose::Identity();
    pose.translation() = 0.5 * (range.min + range.max);
    scene.obstacles.push_back(make_box(pose, range.max - range.min));
  }
  if (cell.camera && cell.camera->keep_out_mm > 0) {
    const bool fixed = cell.mount() == CameraMount::fixed;
    const Vec3 at = (fixed ? base_from_camera : cell.hand_eye.parent_from_camera).translation();
    (fixed ? scene.obstacles : scene.on_flange).push_back(make_capsule(at, at, cell.camera->keep_out_mm));
  }
  add_parts(scene, found.items, true, known);
  add_parts(scene, found.uncertain, false, known);
  return scene;
}

std::vector<Convex> arm_bodies(const robot::RobotModel& robot, const robot::Arm& arm, double waist,
                               const robot::Joints& joints) {
  const robot::LinkFrames frames = link_frames(arm, joints);
  const Pose base = base_from_arm(robot, arm, waist);
  std::vector<Convex> bodies;
  for (const robot::LinkCapsule& c : arm.capsules)
    bodies.push_back(moved(base * frames.arm_from_link[c.link], make_capsule(c.from, c.to, c.radius)));
  if (!arm.capsules.empty()) return bodies;
  // Links of industrial arms are some seventh of their length thick, hands half of that.
  constexpr double kThick = 1.0 / 14, kWristThick = 1.0 / 28;
  const bool seven = arm.kind == robot::ArmKind::srs_7;
  const double length = seven ? arm.seven.upper + arm.seven.fore : arm.six.c2 + std::hypot(arm.six.a2, arm.six.c3);
  Vec3 from = Vec3::Zero();
  for (int i = 1; i < frames.count; ++i) {
    const Vec3 to = frames.arm_from_link[i].translation();
    if ((to - from).norm() < 1e-6) continue;
    const double radius = length * (i + 1 == frames.count ? kWristThick : kThick);
    bodies.push_back(moved(base, make_capsule(from, to, radius)));
    from = to;
  }
  return bodies;
}

}  // namespace tribin::grasp
