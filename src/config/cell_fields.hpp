#pragma once

#include "io/toml_fields.hpp"
#include "tribin/config/work_cell.hpp"

// The keys of each section of a work cell file.
namespace tribin::config {

io::Fields<CellCamera> camera_fields();
io::Fields<CellBin> bin_fields();
io::Fields<Gripper> gripper_fields();
io::Fields<CellPart> part_fields();
io::Fields<Rack> rack_fields();
io::Fields<Regrasp> regrasp_fields();
io::Fields<InHand> in_hand_fields();
io::Fields<CellRobot> robot_fields();
io::Fields<Safety> safety_fields();

/// [hand_eye]: base_from_camera of a fixed camera, flange_from_camera of one on the flange.
struct HandEyeKeys {
  std::optional<CellHandEye> base_from_camera, flange_from_camera;
};
io::Fields<HandEyeKeys> hand_eye_fields();

}  // namespace tribin::config
