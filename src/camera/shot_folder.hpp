#pragma once

#include <filesystem>

#include "tribin/camera/camera.hpp"

// One recorded shot as a folder.
namespace tribin::camera {

bool is_shot(const std::filesystem::path& folder);
Shot read_shot(const std::filesystem::path& folder, const std::filesystem::path& frames_file);
/// Makes the folder. Of a scan every bit is kept, NaN holes included.
void write_shot(const std::filesystem::path& folder, const Shot& shot);

}  // namespace tribin::camera
