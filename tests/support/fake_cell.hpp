#pragma once

// A cell without camera and physics: parts stand in a row, the robot is a simulated controller, and what it grips and
// lets go is the truth. For tests of the cycle itself.

#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tribin/config/robot_file.hpp"
#include "tribin/controller_sim/machine.hpp"
#include "tribin/picking/cycle.hpp"

namespace tribin::test {

inline Pose looking_down(const Vec3& at) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0));
  pose.translation() = at;
  return pose;
}

/// Two kinds of part, a rack of six slots in turn, one gripper that looks down.
inline WorkCell fake_work_cell() {
  WorkCell cell;
  cell.file = "fake.toml";
  cell.hand_eye.parent_from_camera = looking_down(Vec3(1200, 0, 1400));
  cell.hand_eye.sigma_mm = 0.2;
  Gripper gripper;
  gripper.name = "jaw";
  gripper.stroke_mm = {0, 100};
  gripper.finger_mm = Vec3(8, 12, 60);
  gripper.flange_from_tcp.translation() = Vec3(0, 0, 150);
  cell.grippers.push_back(gripper);
  for (const char* name : {"a", "b"}) {
    CellPart part;
    part.name = name;
    cell.parts.push_back(part);
  }
  Rack rack;
  rack.base_from_rack.translation() = Vec3(900, 700, 60);
  rack.slots = {2, 3, 1, Vec3(120, 120, 0), 0};
  rack.sequence = {"a", "b"};
  cell.rack = rack;
  CellRobot robot;
  robot.model = std::string(TRIBIN_SOURCE_DIR) + "/examples/robots/gp110.toml";
  cell.robots.push_back(robot);
  cell.safety.allow_arm = true;
  cell.safety.workspace_mm = CellRange{Vec3(-1500, -1500, 0), Vec3(2000, 2000, 1500)};
  return cell;
}

inline robot::SafetyLimits fake_limits(const WorkCell& cell) {
  robot::SafetyLimits limits;
  limits.allow_arm = true;
  limits.workspace = robot::Box{cell.safety.workspace_mm->min, cell.safety.workspace_mm->max};
  limits.tools = {1, 2};
  return limits;
}

/// Where part number i lies. a, b, a, b, ...
inline Vec3 place_in_bin(int part) { return Vec3(1100 + 70 * (part % 6), -200 + 70 * (part / 6), 30); }
inline constexpr double kGrip_mm = 20;  // above the part's foot
inline std::string kind_of(int part) { return part % 2 ? "b" : "a"; }

/// What is true: moved by the machine's gripper, kept in a file for another process to see.
class FakeTruth {
 public:
  FakeTruth(const WorkCell& cell, int parts, std::string file = {})
      : slots_(picking::slots_of(*cell.rack)), file_(std::move(file)) {
    refill(parts);
  }
  void refill(int parts) {
    in_bin.assign(static_cast<std::size_t>(parts), true);
    rack.assign(slots_.size(), {});
    held = held_by_second = -1;
    save();
  }

  controller_sim::MachineOptions machine_options() {
    controller_sim::MachineOptions options;
    options.on_output = [this](controller_sim::Machine& machine, int output, bool on) {
      if (output <= machine.arms()) machine.set_input(output, on ? grip(machine, output) : let_go(machine, output));
    };
    return options;
  }

  std::vector<bool> in_bin;
  std::vector<std::vector<std::string>> rack;  ///< what was put into each slot: more than one is too much
  int held = -1, held_by_second = -1, lost = 0, grips = 0;
  std::vector<int> slippery;   ///< parts that the next grip misses
  std::function<Vec3()> slip;  ///< drawn at each grip, base; a gripper that looks down carries it
  Vec3 slipped = Vec3::Zero();
  std::vector<double> off_mm;  ///< of what was placed, from its slot

 private:
  /// Of the foot of what is gripped.
  static Vec3 at(const controller_sim::Machine& machine, int arm) {
    return robot::pose_of(machine.position(arm)).translation() - Vec3(0, 0, kGrip_mm);
  }

  bool grip(const controller_sim::Machine& machine, int arm) {
    ++grips;
    int& hand = arm == 1 ? held : held_by_second;
    for (std::size_t i = 0; i < in_bin.size() && hand < 0; ++i) {
      if (!in_bin[i] || (at(machine, arm) - place_in_bin(static_cast<int>(i))).norm() > 1) continue;
      const auto slips = std::find(slippery.begin(), slippery.end(), static_cast<int>(i));
      if (slips != slippery.end()) {
        slippery.erase(slips);
        return false;
      }
      hand = static_cast<int>(i);
      if (slip) slipped = slip();
      in_bin[i] = false;
    }
    save();
    return hand >= 0;
  }
  bool let_go(const controller_sim::Machine& machine, int arm) {
    const int part = std::exchange(arm == 1 ? held : held_by_second, -1);
    if (part < 0) return false;
    bool placed = false;
    for (std::size_t i = 0; i < slots_.size(); ++i)
      if ((slots_[i].base_from_slot.translation() - at(machine, arm)).norm() < 1) {
        rack[i].push_back(kind_of(part));
        off_mm.push_back((slots_[i].base_from_slot.translation() - at(machine, arm) - slipped).norm());
        placed = true;
      }
    lost += !placed;
    save();
    return false;
  }
  void save() const {
    if (file_.empty()) return;
    {
      std::ofstream out(file_ + ".new");
      for (const bool there : in_bin) out << (there ? '1' : '0');
    }
    std::rename((file_ + ".new").c_str(), file_.c_str());
  }

  std::vector<picking::Slot> slots_;
  std::string file_;
};

/// Vision that knows where the parts are.
class FakeVision : public picking::Vision {
 public:
  /// \param in_bin  asked at each scan
  FakeVision(const robot::RobotModel& robot, std::function<std::vector<bool>()> in_bin)
      : robot_(robot), in_bin_(std::move(in_bin)) {
    for (const char* name : {"a", "b"}) {
      Part part;
      part.name = name;
      part.box_min = Vec3(-20, -20, 0), part.box_max = Vec3(20, 20, 30);
      part.diameter_mm = 60;
      models_.push_back(part);
    }
  }

  void plan_for(const picking::ArmAtWork& arm) override { at_work_ = arm; }

  picking::Sight scan(const picking::FlangePose& flange) override {
    ++scans;
    if (flange) looked_from.push_back(flange().translation());
    picking::Sight sight;
    seen_ = in_bin_();
    for (std::size_t i = 0; i < seen_.size(); ++i)
      if (seen_[i]) ++sight.seen[kind_of(static_cast<int>(i))];
    sight.status = sight.seen.empty() ? "empty" : "ok";
    sight.suspect = suspect;
    return sight;
  }

  grasp::Plan plan(const grasp::PlanOptions& options, const picking::Places& places) override {
    asked.push_back(options);
    grasp::Plan plan;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const int part = static_cast<int>(i);
      if (!seen_[i] || !places.count(kind_of(part))) continue;
      if (hard.count(part) && (!options.grippers.empty() || options.max_tilt_rad)) continue;
      if (std::find(buried.begin(), buried.end(), part) != buried.end()) continue;
      if (shadowed.count(part) && looked_from.back().x() < shadowed.at(part)) continue;
      const Pose at = looking_down(place_in_bin(part) + Vec3(0, 0, kGrip_mm));
      const bool tried = std::any_of(options.failed.begin(), options.failed.end(), [&](const grasp::FailedPick& f) {
        return (f.base_from_tcp.translation() - at.translation()).norm() < 5;
      });
      if (!tried) plan.grasps.push_back(grasp_at(part, at));
    }
    return plan;
  }
  grasp::PushPlan plan_pushes(const grasp::PlanOptions&) override {
    grasp::PushPlan plan;
    if (buried.empty()) return plan;
    grasp::Push push;
    push.part_name = kind_of(buried.back());
    push.gripper = "jaw";
    for (const grasp::PathPoint& point :
         grasp_at(buried.back(), looking_down(place_in_bin(buried.back()) + Vec3(0, 0, kGrip_mm))).path)
      push.path.push_back(point);
    plan.pushes.push_back(push);
    if (++pushes >= pushes_to_free) buried.pop_back();
    return plan;
  }
  grasp::Plan plan_standing(const std::string&, const Pose&, const grasp::PlanOptions&,
                            const picking::Places&) override {
    return {};
  }
  grasp::PartHere part(int index) const override {
    grasp::PartHere here;
    here.id = index;
    here.base_from_part.translation() = place_in_bin(index);
    here.covariance.diagonal() << Vec3::Constant(0.01), Vec3::Constant(1e-6);
    return here;
  }
  const Part& model(const std::string& name) const override { return models_[name == "b"]; }

  picking::HandSight look_at_hand(const std::string&, const picking::HandView& view) override {
    ++hand_looks;
    return in_hand(view);
  }

  picking::RoomSeen room(const Pose& base_from_box, const Vec3&) const override {
    for (const auto& [at, seen] : rooms)
      if ((at - base_from_box.translation()).norm() < 40) return seen;
    return picking::RoomSeen::empty;
  }

  std::vector<std::pair<Vec3, picking::RoomSeen>> rooms;  ///< that are not empty
  std::function<picking::HandSight(const picking::HandView&)> in_hand;
  int hand_looks = 0;
  int scans = 0, pushes = 0, pushes_to_free = 1;
  std::map<int, bool> hard;        ///< parts that only full tilt takes
  std::vector<int> buried;         ///< parts that a push frees
  std::vector<Vec3> looked_from;   ///< by a camera on the flange: where that stood at each scan
  std::map<int, double> shadowed;  ///< parts that are seen well enough from beyond that x of the flange alone
  std::string suspect;             ///< of the calibration
  std::vector<grasp::PlanOptions> asked;

 private:
  grasp::Grasp grasp_at(int part, const Pose& at) const {
    grasp::Grasp grasp;
    grasp.part = grasp.id = part;
    grasp.part_name = kind_of(part), grasp.gripper = at_work_.robot ? "jaw_2" : "jaw", grasp.family = "top";
    Pose base_from_part = Pose::Identity();
    base_from_part.translation() = place_in_bin(part);
    grasp.part_from_tcp = base_from_part.inverse() * at;
    grasp.opening_before_mm = 50;
    grasp.score = 1;
    const robot::Arm& arm = robot_.arms.at(at_work_.robot);
    for (const auto& [step, up] : {std::pair{grasp::Step::pre_pick, 80.0}, std::pair{grasp::Step::pick, 0.0},
                                   std::pair{grasp::Step::retreat, 120.0}}) {
      grasp::PathPoint point{step, at, {}};
      point.base_from_tcp.translation().z() += up;
      Pose flange = point.base_from_tcp;
      flange.translation().z() += 150;
      point.joints = reach(arm, base_from_arm(robot_, arm, at_work_.waist).inverse() * flange)->joints;
      grasp.path.push_back(point);
    }
    return grasp;
  }

  const robot::RobotModel& robot_;
  picking::ArmAtWork at_work_;
  std::function<std::vector<bool>()> in_bin_;
  std::vector<bool> seen_;
  std::vector<Part> models_;
};

}  // namespace tribin::test
