// What the planner takes for a hold against what the simulated contact says: two models of the same jaws that share no
// code.
#include <gtest/gtest.h>

#include <algorithm>

#include "sim/cell_errors.hpp"
#include "sim/grip.hpp"
#include "sim/random.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/grasp/candidates.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/io/part_cache.hpp"

namespace tribin::sim {
namespace {

const std::filesystem::path kSource = TRIBIN_SOURCE_DIR;

TEST(Grip, PlannedGraspsHoldAndLeaveThePartWhereItIs) {
  constexpr double kOpen_mm = 6, kPlace_mm = 0.5, kTurn = 0.2 * kDegree;  // before they close; of the pose, rms
  const WorkCell cell = read_work_cell(kSource / "examples/cells/pick_cell.toml");
  for (const CellPart& in_cell : cell.parts) {
    SCOPED_TRACE(in_cell.name);
    PartReadOptions options;
    options.name = in_cell.name;
    options.cad.unit = length_unit_from_name(in_cell.unit);
    options.cache = part_cache_folder();
    const Part part = read_part(in_cell.cad, options);
    const Solid solid(part.mesh);
    const grasp::GraspPart known = grasp::prepare_grasps(part, in_cell, cell.grippers);
    Random random(1);
    int count = 0, held = 0, still = 0;
    for (std::size_t i = 0; i < known.candidates.size(); i += 4) {
      const grasp::Candidate& candidate = known.candidates[i];
      const grasp::GripperShape& gripper = known.grippers[candidate.gripper];
      const Pose planned = candidate.part_from_tcp.inverse();
      const Pose tcp_from_part = drawn_motion(kPlace_mm, kTurn, random) * planned;
      const double opening = std::min(candidate.opening_mm + kOpen_mm, gripper.stroke_max());
      const Grip grip =
          close_gripper(gripper, opening, solid, tcp_from_part, gripper.gripper.friction, in_cell.mass_kg);
      ++count;
      held += grip.holds;
      // The jaws put it back into their middle and turn it no farther than it was.
      const Pose now = grip.motion * tcp_from_part;
      still += grip.holds && std::abs((now.translation() - planned.translation()).x()) < 1 &&
               rotation_angle(now.linear(), planned.linear()) < 5 * kTurn;
    }
    EXPECT_GT(count, 200);
    EXPECT_GE(held, 0.99 * count) << count;
    EXPECT_GE(still, 0.98 * count) << count;
  }
}

}  // namespace
}  // namespace tribin::sim
