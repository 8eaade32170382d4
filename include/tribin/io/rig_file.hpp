#pragma once

#include <filesystem>

#include "tribin/capture/rig.hpp"

namespace tribin {

/// Reads the calibration of a rig:
/// - rig.json: {"cameras": [{"name", "width", "height", "K": [9], "distortion": [k1, k2, p1, p2, k3],
///   "rig_from_camera": {"rotation": [[3 x 3]], "translation_mm": [3]}}], "projector": {the same} or null};
/// - rig.json that names OpenCV's files: {"opencv": ["intrinsic.yml", "extrinsic.yml"], "unit_mm": 1, "names": ["left",
///   "right"]}, sought beside it and then in `folder`;
/// - an OpenCV YAML file of two cameras: M1, D1, M2, D2, R, T (second_from_first, millimetres), as stereoCalibrate's
///   samples write them, in one file or in several.
/// \param folder  further place of files that rig.json names.
/// \throws Error bad_input (file, place, seen, wanted).
Rig read_rig(const std::filesystem::path& path, const std::filesystem::path& folder = {});

/// Writes rig.json.
void write_rig(const std::filesystem::path& path, const Rig& rig);

}  // namespace tribin
