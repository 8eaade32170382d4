#pragma once

#include <string>
#include <vector>

#include "tribin/grasp/grasp.hpp"

// What plans of grasps and of pushes share.
namespace tribin::grasp {

/// How often each reason stands, most frequent first.
std::vector<WhyCount> counted(const std::vector<RefusedGrasp>& refused);

/// Whether the options allow a gripper.
bool may_use(const PlanOptions& options, const std::string& gripper);

}  // namespace tribin::grasp
