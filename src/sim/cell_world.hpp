#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "sim/cell_errors.hpp"
#include "sim/live_heap.hpp"
#include "sim/random.hpp"
#include "tribin/cad/mesh.hpp"
#include "tribin/grasp/gripper_shape.hpp"
#include "tribin/picking/rack.hpp"
#include "tribin/sim/work_cell.hpp"

namespace tribin::sim {

/// A box or a cylinder as a mesh, another body as one around it. (cell_start.cpp)
Mesh mesh_of(const grasp::Convex& body);

/// What happens in the cell while the controller moves the arm: the heap, the gripper, what it holds and what it
/// touches. Base frame, unless a name says otherwise.
class CellWorld {
 public:
  CellWorld(const WorkCell& cell, const robot::RobotModel& robot, const CellStock& stock,
            const SimulatedCellOptions& options);

  /// The arms have come here, at this time. Steps the physics up to it.
  void follow(const controller_sim::Machine& machine);
  /// The gripper of an arm (from 1) closes, or its vacuum is switched on. \return whether it holds something
  bool close(const controller_sim::Machine& machine, int arm = 1);
  void open(const controller_sim::Machine& machine, int arm = 1);
  /// How far the waist turned since it was asked last: base_now_from_base_before of what it carries.
  std::optional<Pose> waist_turn(const controller_sim::Machine& machine);
  /// Nothing in the heap moves.
  bool at_rest() const { return heap_->at_rest(); }
  bool reachable(const Pose& base_from_tcp, int tool) const;

  const CellTruth& truth();
  /// Parts that stand or lie somewhere, not in the hand.
  struct Standing {
    int part_class;
    Pose base_from_part;
  };
  std::vector<Standing> standing() const;
  /// What else a camera may see: grippers as they stand open, what they hold, the arms' links.
  struct Carried {
    Mesh mesh;
    Pose base_from_mesh;
    bool part = false;
  };
  std::vector<Carried> carried() const;
  /// The true one; of a camera on the flange where that stands now.
  Pose base_from_camera() const;
  void note_scan();

 private:
  struct Tool {
    grasp::GripperShape shape;
    std::vector<Mesh> meshes;
    std::vector<Solid> solids;
    std::vector<int> bodies;  ///< in the heap
    double opening_mm = 0;
  };

  /// An arm in motion.
  struct MovingArm {
    int number = 1;
    const robot::Arm* arm = nullptr;
    Pose base_from_tcp = Pose::Identity();
    std::optional<robot::Joints> joints;
    int held = -1;
    Pose tcp_from_held = Pose::Identity();
    int tool = -1, cycle = 0;
    Vec3 looked_at = Vec3::Constant(1e9), arm_looked_at = Vec3::Constant(1e9);
  };

  void drop_parts(const SimulatedCellOptions& options);
  Pose upright_at_wall(const Solid& solid, int number, double above_mm);
  void add_tools(const WorkCell& cell);
  Pose true_tcp(const controller_sim::Machine& machine, int arm) const;
  void set_opening(Tool& tool, const controller_sim::Machine& machine, int arm);
  Tool& tool_of(MovingArm& arm, const controller_sim::Machine& machine);
  void take_command(MovingArm& arm, const controller_sim::Machine& machine);
  void place_bodies(const MovingArm& arm);
  void step_physics(double until_s);
  void find_contacts(const MovingArm& arm, const controller_sim::Machine& machine);
  void find_arm_contacts(MovingArm& arm, const controller_sim::Machine& machine);
  void find_contacts_of_arms(const controller_sim::Machine& machine);
  std::vector<grasp::Convex> bodies_of_arm(const MovingArm& arm) const;
  bool is_held(int part) const;
  void note(const std::string& what, double depth_mm, const controller_sim::Machine& machine, int arm);
  void note_placed(int part, int slot, const Pose& base_from_wanted);
  bool in_push(const controller_sim::Machine& machine, int arm) const;

  const WorkCell& cell_;
  const robot::RobotModel& robot_;
  const CellStock& stock_;
  SimulatedCellOptions options_;
  Random random_;
  RobotField field_;
  Pose base_from_bin_, parent_from_camera_;  ///< true; the parent is base or flange, as the mount says
  std::vector<picking::Slot> slots_;
  std::vector<Mesh> own_;
  std::vector<int> class_of_;
  std::unique_ptr<LiveHeap> heap_;
  std::vector<Tool> tools_;
  std::vector<MovingArm> arms_;
  double waist_ = 0, physics_s_ = 0;
  std::set<std::pair<int, std::string>> noted_;
  std::vector<Pose> at_scan_;
  CellTruth truth_;
};

}  // namespace tribin::sim
