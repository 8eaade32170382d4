#include <algorithm>

#include "bin_space.hpp"
#include "judge.hpp"

// The arm's links along the path.
namespace tribin::grasp {
namespace {

/// How far a body goes from one place to another, at most [mm].
double moves_by(const Convex& a, const Convex& b) {
  double most = 0;
  for (const int side : {-1, 1}) {
    const Vec3 end(0, 0, side * a.half_mm.z());
    most = std::max(most, (b.frame_from_body * end - a.frame_from_body * end).norm());
  }
  return most;
}

}  // namespace

Checked check_arm(const SceneFacts& facts, Attempt& a) {
  if (!a.arm_path) return {};
  const ArmHere& arm = *facts.scene->arm;
  const double clearance = facts.options->clearance_mm;
  std::vector<Convex> before;
  for (const robot::Joints& joints : a.arm_path->along) {
    std::vector<Convex> links = arm_bodies(*arm.robot, *arm.arm, arm.waist, joints);
    const Pose base_from_flange = base_from_arm(*arm.robot, *arm.arm, arm.waist) * arm_from_flange(*arm.arm, joints);
    for (const Convex& carried : facts.scene->on_flange) links.push_back(moved(base_from_flange, carried));
    if (before.empty()) before = links;
    for (std::size_t k = 0; k < links.size(); ++k) {
      // What does not move stands where it was put. Between two places a link is half their distance from one of them.
      const double step = moves_by(before[k], links[k]);
      if (step == 0 && &joints != &a.arm_path->along.front()) continue;
      const double wanted = clearance + step / 2;
      const auto refuse = [&](Why why, double gap) { return Refusal{why, gap - step / 2, clearance}; };
      const double bin = least_gap({links[k]}, facts.bin, wanted);
      if (bin < wanted) return refuse(Why::arm_bin, bin);
      const double obstacle = least_gap({links[k]}, facts.scene->obstacles, wanted);
      if (obstacle < wanted) return refuse(Why::arm_obstacle, obstacle);
      const double scan = a.around ? a.around->gap_mm(links[k], wanted) : wanted;
      if (scan < wanted) return refuse(Why::arm_scan, scan);
    }
    before = links;
  }
  return {};
}

}  // namespace tribin::grasp
