#include "tribin/robot/cell_limits.hpp"

#include <algorithm>

namespace tribin::robot {

SafetyLimits limits_of(const WorkCell& cell) {
  SafetyLimits limits;
  limits.allow_arm = cell.safety.allow_arm;
  if (cell.safety.workspace_mm) limits.workspace = Box{cell.safety.workspace_mm->min, cell.safety.workspace_mm->max};
  for (const CellRange& box : cell.safety.forbidden_mm) limits.forbidden.push_back({box.min, box.max});
  limits.scan_max_age_s = cell.safety.scan_max_age_s;
  if (!cell.robots.empty()) {
    const auto slowest =
        std::min_element(cell.robots.begin(), cell.robots.end(),
                         [](const CellRobot& a, const CellRobot& b) { return a.speed_cap_mm_s < b.speed_cap_mm_s; });
    limits.speed_mm_s = slowest->speed_cap_mm_s;
  }
  return limits;
}

}  // namespace tribin::robot
