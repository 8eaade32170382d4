#pragma once

#include "tribin/config/work_cell.hpp"
#include "tribin/robot/safety.hpp"

namespace tribin::robot {

/// What a work cell allows: consent, workspace, forbidden boxes, age of scans, the speed cap of its slowest robot. Tool
/// numbers are confirmed on the controller and added by who drives it.
SafetyLimits limits_of(const WorkCell& cell);

}  // namespace tribin::robot
