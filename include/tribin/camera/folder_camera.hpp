#pragma once

#include <filesystem>
#include <memory>

#include "tribin/camera/camera.hpp"

namespace tribin {

/// A camera that gives recorded shots again. The folder is one shot (it has frames.json, or scan.npy), or holds
/// recorded shots as folders, which are given in the order of their names.
/// \param frames_file  describes a folder of frames that has no frames.json.
/// \throws Error bad_input where the folder holds neither; `grab` throws too_little_data after the last shot.
std::unique_ptr<Camera> open_folder_camera(const std::filesystem::path& folder,
                                           const std::filesystem::path& frames_file = {});

/// Adds a shot to a recording: the next folder 000001, 000002, .. below `recording`, which is made if absent. It
/// appears when it is whole. Replayed, it gives the same bytes: frames as PNG, scans as float NPY with their camera,
/// modulation and reasons as PNG, time and place as taken.json. \return the shot's folder. \throws Error bad_input
/// where it cannot be written.
std::filesystem::path record_shot(const std::filesystem::path& recording, const Shot& shot);

}  // namespace tribin
