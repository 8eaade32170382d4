#pragma once

#include <filesystem>
#include <string>

#include "tribin/kinematics/arm.hpp"

namespace tribin {

/// Reads a robot's geometry file (TOML); examples/robots has some, docs/robot.md lists the keys.
/// \throws Error bad_input (file, line and column, seen, wanted) for what is no TOML, unknown keys, wrong types, values
/// out
///               of range, and for numbers that are still to be filled in.
robot::RobotModel read_robot(const std::filesystem::path& path);

/// The table of all keys, as docs/robot.md shows it. Markdown.
std::string robot_keys();

}  // namespace tribin
