#include "tribin/sim/work_cell.hpp"

#include <algorithm>

#include "sim/cell_world.hpp"
#include "sim/drawn_scene.hpp"
#include "tribin/core/error.hpp"
#include "tribin/robot/hses.hpp"
#include "tribin/robot/nx100.hpp"
#include "tribin/sim/cell_view.hpp"

namespace tribin::sim {
namespace {

constexpr double kTick_s = 1.0 / 240;  // one step of the physics
constexpr double kScan_s = 0.3;        // of a pattern set
constexpr double kLongestFall_s = 3;   // until a heap is looked at although something still moves
constexpr double kToolShine = 0.3;     // of grippers and arms: painted, or dull steel

/// A clock on which waiting lets the cell go on, in steps of the physics.
class CellClock : public controller_sim::VirtualClock {
 public:
  CellClock(controller_sim::Machine& machine, CellWorld& world) : machine_(machine), world_(world) {}

  void sleep_s(double seconds) override {
    for (double left = seconds; left > 0;) {
      const double step = std::min(left, kTick_s);
      VirtualClock::sleep_s(step);
      left -= step;
      machine_.advance(now_s());
      if (now_s() - seen_s_ < kTick_s) continue;
      seen_s_ = now_s();
      if (const std::optional<Pose> turn = world_.waist_turn(machine_)) {  // it carries both arms
        for (int arm = 1; arm <= machine_.arms(); ++arm) {
          robot::CartesianPosition at = machine_.position(arm);
          machine_.place(robot::position_from_pose(*turn * robot::pose_of(at), at.type, at.tool, at.frame), arm);
        }
      }
      world_.follow(machine_);
    }
  }

 private:
  controller_sim::Machine& machine_;
  CellWorld& world_;
  double seen_s_ = 0;
};

controller_sim::MachineOptions options_of(CellWorld& world) {
  controller_sim::MachineOptions options;
  options.on_output = [&world](controller_sim::Machine& machine, int output, bool on) {
    if (output < 1 || output > machine.arms()) return;  // of arm n: output and input n
    if (!on) world.open(machine, output);
    machine.set_input(output, on && world.close(machine, output));
  };
  return options;
}

void check(const WorkCell& cell) {
  const std::string file = cell.file.string();
  const auto want = [&file](bool there, const char* saw, const char* wanted) {
    if (!there) throw Error(ErrorCode::bad_input, file + ": saw " + saw + ", wanted " + wanted + " to simulate");
  };
  want(cell.bin.has_value(), "no [bin]", "one");
  want(!cell.parts.empty(), "no [[part]]", "one at least");
  want(!cell.grippers.empty(), "no [[gripper]]", "one at least");
  want(!cell.robots.empty(), "no [[robot]]", "one");
  want(cell.mount() == CameraMount::fixed || !cell.camera->looks.empty(), "no camera.looks", "one at least");
  want(cell.robots.size() <= 2, "more than two robots", "two arms at most");
  for (const CellRobot& robot : cell.robots)
    want(cell.robots.size() == 1 || (robot.wait && !robot.grippers.empty()), "two robots without wait and grippers",
         "both of each");
  want(cell.robots.front().controller.kind != ControllerKind::text, "a robot that is a client", "nx100 or hses");
}

}  // namespace

std::shared_ptr<const CellStock> make_cell_stock(std::vector<Mesh> meshes) {
  auto stock = std::make_shared<CellStock>();
  stock->meshes = std::move(meshes);
  for (const Mesh& mesh : stock->meshes) stock->solids.emplace_back(mesh);
  return stock;
}

struct SimulatedCell::State : Camera {
  const WorkCell& cell;
  std::shared_ptr<const CellStock> stock;
  SimulatedCellOptions options;
  CellWorld world;
  controller_sim::Machine machine;
  CellClock clock;
  controller_sim::Wire wire;
  CellView view;
  std::uint64_t shots = 0;

  State(const WorkCell& cell_in, const robot::RobotModel& robot, std::shared_ptr<const CellStock> stock_in,
        const SimulatedCellOptions& options_in)
      : cell(cell_in),
        stock(std::move(stock_in)),
        options(options_in),
        world(cell, robot, *stock, options),
        machine(options_of(world)),
        clock(machine, world),
        wire(machine, options.faults),
        view(cell_view_of(cell, cell.camera->looks.empty() ? Pose::Identity() : cell.camera->looks.front())) {
    if (cell.mount() == CameraMount::hand) {  // the arm stands where it looks from
      const Pose tcp = cell.camera->looks.front() * cell.grippers.front().flange_from_tcp;
      machine.place(robot::position_from_pose(tcp, 0, 1));
      world.follow(machine);
    }
    if (cell.robots.size() > 1) {
      start_two_arms();
      return;
    }
    machine.add_job(controller_sim::parse_job(controller_sim::handshake_job(), "BPICK"));
    machine.start("BPICK");
  }

  /// Each stands where it waits, with the first of its grippers.
  void start_two_arms() {
    for (int arm = 1; arm <= 2; ++arm) {
      const CellRobot& robot = cell.robots[static_cast<std::size_t>(arm) - 1];
      const auto is_first = [&](const Gripper& g) { return g.name == robot.grippers.front(); };
      const auto gripper = std::find_if(cell.grippers.begin(), cell.grippers.end(), is_first);
      machine.place(robot::position_from_pose(*robot.wait * gripper->flange_from_tcp, 0,
                                              static_cast<int>(gripper - cell.grippers.begin()) + 1, 0),
                    arm);
      machine.add_job(controller_sim::parse_job(controller_sim::handshake_job_of_arm(arm), "BPICK"));
    }
    machine.add_job(controller_sim::parse_job(controller_sim::waist_job(), "TWAIST"));
    machine.start("BPICK1");
    machine.run_beside("BPICK2");
    world.follow(machine);
  }

  std::string name() const override { return "sim"; }

  SimulatedScan scan(bool noisy) {
    view.camera_from_bin = world.base_from_camera().inverse() * cell.bin->base_from_bin;
    Random random(mixed(options.seed) ^ 0x5CA7u);  // one camera, one level of noise, for the whole run
    StructuredLight sensor;
    double top = 0;
    const auto standing = world.standing();
    const Pose bin_from_base = cell.bin->base_from_bin.inverse();
    for (const auto& part : standing) top = std::max(top, (bin_from_base * part.base_from_part).translation().z());
    const BinView bin =
        view_of_cell(view, std::min(top, cell.bin->inner_size_mm.z()), settings_of(Level::easy), random, sensor);
    const std::vector<Mesh> meshes = bin_and_table_meshes(bin);
    std::vector<Body> bodies = table_and_bin(bin, meshes);
    const Pose camera_from_base = world.base_from_camera().inverse();
    for (const auto& part : standing)
      bodies.push_back({&stock->meshes[part.part_class], camera_from_base * part.base_from_part, 0.45, 1});
    // A camera on the flange is mounted so that its own tool is not in its view.
    const auto carried = cell.mount() == CameraMount::fixed ? world.carried() : std::vector<CellWorld::Carried>();
    for (const auto& body : carried)
      bodies.push_back(
          {&body.mesh, camera_from_base * body.base_from_mesh, 0.45, body.part ? 1.0 : kToolShine, body.part});
    if (!noisy) sensor.noise_mm = 1e-3, sensor.mixed_pixels = false, sensor.systematic = 0;
    return simulate_scan(bodies, sensor, mixed(options.seed) + shots);
  }

  Shot grab() override {
    for (double waited = 0; !world.at_rest() && waited < kLongestFall_s; waited += 0.1) clock.sleep_s(0.1);
    clock.sleep_s(kScan_s);
    world.note_scan();
    ++shots;
    Shot shot;
    shot.content = scan(true).scan;
    shot.taken.time_ms = now_ms();
    return shot;
  }
};

SimulatedCell::SimulatedCell(const WorkCell& cell, const robot::RobotModel& robot,
                             std::shared_ptr<const CellStock> stock, const SimulatedCellOptions& options) {
  check(cell);
  state_ = std::make_unique<State>(cell, robot, std::move(stock), options);
}

SimulatedCell::~SimulatedCell() = default;

Camera& SimulatedCell::camera() { return *state_; }
controller_sim::VirtualClock& SimulatedCell::clock() { return state_->clock; }
controller_sim::Machine& SimulatedCell::machine() { return state_->machine; }
const CellTruth& SimulatedCell::truth() const { return state_->world.truth(); }
SimulatedScan SimulatedCell::look() const { return state_->scan(false); }

std::unique_ptr<robot::Controller> SimulatedCell::connect() {
  State& s = *state_;
  return s.cell.robots.front().controller.kind == ControllerKind::nx100
             ? robot::make_nx100(controller_sim::virtual_stream(s.wire, s.clock), s.clock)
             : robot::make_hses(controller_sim::virtual_datagrams(s.wire, s.clock), s.clock);
}

}  // namespace tribin::sim
