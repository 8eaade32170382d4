#pragma once

#include <filesystem>
#include <string_view>

namespace tribin::io {

/// Writes a whole file: beside its place first, then renamed, so that no partial file is ever seen.
/// \throws Error bad_input when the folder is missing or the disk is full; nothing is left behind then.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace tribin::io
