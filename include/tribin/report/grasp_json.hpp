#pragma once

#include <string>
#include <vector>

#include "tribin/grasp/grasp.hpp"

namespace tribin {

/// What a plan has to say, for programs (schema/grasps.schema.json): grasps with their paths, terms and scores, what
/// was refused and how often for which reason, pushes. Poses are in the base's frame; angles in degrees. \param pushes
/// null: none were planned \param warnings  of who made the scene
std::string grasps_json(const grasp::Scene& scene, const grasp::Plan& plan, const grasp::PushPlan* pushes = nullptr,
                        const std::vector<std::string>& warnings = {});

/// The unit of a reason's value and limit: "mm", "deg", or "" for shares and ratios.
std::string_view unit_of(grasp::Why why);
/// A reason's value or limit in that unit.
double in_unit(grasp::Why why, double value);

}  // namespace tribin
