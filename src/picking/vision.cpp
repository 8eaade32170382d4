#include "tribin/picking/vision.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tribin/core/error.hpp"
#include "tribin/finder/finder.hpp"
#include "tribin/part/symmetry.hpp"
#include "tribin/picking/place.hpp"

namespace tribin::picking {
namespace {

constexpr int kTurns = 24;  // of a round part: 15 deg, what a jaw's width forgives

class CameraVision : public Vision {
 public:
  explicit CameraVision(const VisionParts& from) : from_(from) {
    for (const CellPart& part : from.cell->parts)
      known_.push_back(grasp::prepare_grasps(model(part.name), part, from.cell->grippers));
  }

  Sight scan(const FlangePose& flange) override {
    scan_ = take_scan(flange, base_from_camera_);
    FinderOptions options;
    if (from_.cell->bin) options.bin = known_bin(*from_.cell, scan_);
    found_ = find_parts(scan_, *from_.parts, options);
    make_scene();
    Sight sight;
    sight.status = found_->status;
    for (const grasp::PartHere& part : scene_.parts) sight.seen[part.part->part->name] += part.pick;
    sight.find_ms = found_->times.total();
    for (const Warning& warning : found_->warnings) {
      sight.warnings.push_back(warning.text);
      if (warning.code == "calibration_drift") sight.suspect = warning.text;
    }
    return sight;
  }

  HandSight look_at_hand(const std::string& part, const HandView& view) override {
    Pose base_from_camera = Pose::Identity();
    const Scan scan = take_scan({}, base_from_camera);
    return picking::look_at_hand(scan, base_from_camera, model(part), view);
  }

  RoomSeen room(const Pose& base_from_box, const Vec3& size_mm) const override {
    if (!found_) return RoomSeen::hidden;
    return look_into(scan_, base_from_camera_, base_from_box, size_mm, from_.cell->hand_eye.sigma_mm);
  }

  const Scan* last_scan() const override { return found_ ? &scan_ : nullptr; }

  void plan_for(const ArmAtWork& arm) override { at_work_ = arm; }

  grasp::Plan plan(const grasp::PlanOptions& options, const Places& places) override {
    grasp::Scene scene = scene_for_arm();
    add_places(scene, places);
    return grasp::plan_grasps(scene, options);
  }

  grasp::PushPlan plan_pushes(const grasp::PlanOptions& options) override {
    return grasp::plan_pushes(scene_for_arm(), options);
  }

  grasp::Plan plan_standing(const std::string& part, const Pose& base_from_part, const grasp::PlanOptions& options,
                            const Places& places) override {
    grasp::Scene scene = scene_for_arm();
    scene.scan = nullptr;
    scene.bin.reset();  // it does not stand in the bin: the walls are in the way, and no more
    if (from_.cell->bin)
      for (const grasp::Convex& wall : bodies_of(*from_.cell->bin)) scene.obstacles.push_back(wall);
    scene.parts.clear();
    grasp::PartHere here;
    here.part = &known(part);
    here.base_from_part = base_from_part;
    here.covariance = covariance_of_standing(*from_.cell);
    scene.parts.push_back(here);
    add_places(scene, places);
    return grasp::plan_grasps(scene, options);
  }

  grasp::PartHere part(int index) const override { return scene_.parts.at(static_cast<std::size_t>(index)); }

  const Part& model(const std::string& name) const override {
    for (const Part& part : *from_.parts)
      if (part.name == name) return part;
    throw Error(ErrorCode::bad_input, from_.cell->file.string() + ": saw no [[part]] called " + name + ", wanted one");
  }

 private:
  Scan take_scan(const FlangePose& flange, Pose& base_from_scan_camera) {
    Shot shot = from_.camera->grab();
    if (flange && !shot.taken.base_from_flange) {  // asked afterwards, while the arm still stands
      shot.taken.base_from_flange = flange();
      shot.taken.flange_time_ms = now_ms();
    }
    Scan scan = scan_of(std::move(shot), from_.rig).result.scan;
    const std::optional<std::int64_t> now = from_.any_age ? std::nullopt : std::optional(now_ms());
    base_from_scan_camera =
        base_from_camera(*from_.cell, scan.taken, from_.camera->name(), now) * scan.input_from_camera;
    return scan;
  }

  const grasp::GraspPart& known(const std::string& name) const {
    for (const grasp::GraspPart& part : known_)
      if (part.part->name == name) return part;
    throw Error(ErrorCode::bad_input, from_.cell->file.string() + ": saw no [[part]] called " + name + ", wanted one");
  }

  void make_scene() {
    scene_ = grasp::scene_of(*from_.cell, scan_, base_from_camera_, found_->instances, known_);
    if (!from_.cell->bin) return;
    // What lies outside of the bin is not for picking: a rim, a wall or a thing beside it.
    const CellBin& bin = *from_.cell->bin;
    for (grasp::PartHere& part : scene_.parts) {
      const Part& model = *part.part->part;
      const Vec3 at = bin.base_from_bin.inverse() * (part.base_from_part * Vec3((model.box_min + model.box_max) / 2));
      const bool inside =
          std::abs(at.x()) < bin.inner_size_mm.x() / 2 && std::abs(at.y()) < bin.inner_size_mm.y() / 2 && at.z() > 0;
      part.pick = part.pick && inside;
    }
  }

  grasp::Scene scene_for_arm() const {
    grasp::Scene scene = scene_;
    if (!from_.robot) return scene;
    grasp::ArmHere arm;
    arm.robot = from_.robot;
    arm.arm = &arm_of(*from_.cell, *from_.robot, at_work_.robot);
    arm.waist = at_work_.waist;
    scene.arm = arm;
    scene.obstacles.insert(scene.obstacles.end(), at_work_.others.begin(), at_work_.others.end());
    return scene;
  }

  static void add_places(grasp::Scene& scene, const Places& places) {
    for (grasp::PartHere& part : scene.parts) {
      const auto at = places.find(part.part->part->name);
      part.base_from_placed = at == places.end() ? std::vector<Pose>{} : at->second;
      // A part that no slot takes is in the way, and no more.
      if (at == places.end()) part.pick = false;
    }
  }

  VisionParts from_;
  std::vector<grasp::GraspPart> known_;
  Scan scan_;
  Pose base_from_camera_ = Pose::Identity();
  std::optional<Found> found_;
  grasp::Scene scene_;
  ArmAtWork at_work_;
};

}  // namespace

std::unique_ptr<Vision> open_vision(const VisionParts& from) { return std::make_unique<CameraVision>(from); }

const robot::Arm& arm_of(const WorkCell& cell, const robot::RobotModel& robot, std::size_t number) {
  const std::string& name = cell.robots.at(number).arm;
  return name.empty() ? robot.arms.front() : robot::arm_called(robot, name);
}

std::vector<Pose> alike(const Part& part, const Pose& pose) {
  std::vector<Pose> out;
  const SymmetryGroup group = all_symmetries(part);
  const auto add = [&](const Pose& turn) {
    for (const Pose& same : group.discrete) out.push_back(pose * turn * same);
    if (group.discrete.empty()) out.push_back(pose * turn);
  };
  if (group.continuous.empty()) {
    add(Pose::Identity());
    return out;
  }
  const ContinuousSymmetry& axis = group.continuous.front();
  for (int k = 0; k < kTurns; ++k) {
    Pose turn = Pose::Identity();
    turn.linear() = rotation_from_vector(2 * kPi * k / kTurns * axis.axis);
    turn.translation() = axis.point - turn.linear() * axis.point;
    add(turn);
  }
  return out;
}

}  // namespace tribin::picking
