#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/camera/camera.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/controller_sim/faults.hpp"
#include "tribin/controller_sim/machine.hpp"
#include "tribin/controller_sim/virtual_link.hpp"
#include "tribin/kinematics/arm.hpp"
#include "tribin/robot/controller.hpp"
#include "tribin/sim/bin_scene.hpp"
#include "tribin/sim/structured_light.hpp"

/// A whole work cell without hardware: a heap by physics, a camera that looks at it, a controller that runs the
/// hand-shake's job, an arm that moves in time, a gripper that holds what it really touches. What is true is kept where
/// no planner reads it.
namespace tribin::sim {

/// Parts made ready for physics, once for many cells. Meshes as the cell's parts, in that order.
struct CellStock {
  std::vector<Mesh> meshes;
  std::vector<Solid> solids;
};
/// \throws Error too_little_data for a mesh without volume
std::shared_ptr<const CellStock> make_cell_stock(std::vector<Mesh> meshes);

struct SimulatedCellOptions {
  std::uint64_t seed = 1;
  int parts = 15;         ///< dropped into the bin, classes in turn; fewer where the bin is too small
  bool at_walls = false;  ///< a quarter of them come last, on end at the walls and in the corners
  // What the program does not know: root mean squares, 3-D norms.
  double hand_eye_mm = 0.25, hand_eye_rad = 0.02 * kDegree;  ///< between the file's camera pose and the true one
  double robot_mm = 0.3;                                     ///< a smooth field over the cell
  double slip_mm = 0.3, slip_rad = 0.3 * kDegree;            ///< anew at each grip
  double friction = 0.35;                                    ///< between jaw and part: metal with a thin coat of rubber
  controller_sim::FaultPlan faults{{}, 0, 1, 2, 30, 5};      ///< of the wire
};

/// Something touched what it must not.
struct CellCollision {
  double time_s = 0;
  int cycle = 0;     ///< of the hand-shake
  std::string what;  ///< "gripper piece 2 and alternator_a 3"
  double depth_mm = 0;
};

/// The class number (B002) under which way points are a push: then the closed jaws may touch parts.
inline constexpr int kPushClass = 255;

enum class Whereabouts { in_bin, in_hand, placed, at_station, lost };

/// What is true of one part.
struct PartTruth {
  std::string part;
  Whereabouts where = Whereabouts::in_bin;
  Pose base_from_part = Pose::Identity();
  int slot = 0;        ///< placed: the nearest slot, as picking::slots_of numbers them
  double off_mm = 0;   ///< placed: from where it should stand
  double off_rad = 0;  ///< the same, symmetries aside
  int times_placed = 0;
};

struct CellTruth {
  std::vector<PartTruth> parts;
  std::vector<CellCollision> collisions;
  std::vector<std::string> failed_grips;  ///< why, one a grip that held nothing
  int grips = 0, disturbed = 0;           ///< parts that a touch moved by more than 2 mm
  double simulated_s = 0;
};

/// Not safe for several threads: client, controller and world share one.
class SimulatedCell {
 public:
  /// \param cell   with bin, gripper and robot; must outlive it, as must the robot
  /// \throws Error bad_input where the cell lacks what a simulation needs, out_of_range where no part fits into the bin
  SimulatedCell(const WorkCell& cell, const robot::RobotModel& robot, std::shared_ptr<const CellStock> stock,
                const SimulatedCellOptions& options = {});
  ~SimulatedCell();
  SimulatedCell(const SimulatedCell&) = delete;
  SimulatedCell& operator=(const SimulatedCell&) = delete;

  Camera& camera();                       ///< a scan takes 0.3 s of the cell's clock
  controller_sim::VirtualClock& clock();  ///< waiting moves everything
  controller_sim::Machine& machine();
  /// A client of the cell's controller, over its protocol. The cell must outlive it.
  std::unique_ptr<robot::Controller> connect();
  /// What judges the program: it has no way to it.
  const CellTruth& truth() const;
  /// Pictures of the cell as it is now, for reports: the bin as the camera sees it, without noise.
  SimulatedScan look() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tribin::sim
