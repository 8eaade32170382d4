#pragma once

#include <filesystem>

#include "tribin/core/image.hpp"

namespace tribin {

/// Writes primitive ids as a 16-bit grey PNG.
/// \throws Error bad_option when the file cannot be written.
void write_label_png(const std::filesystem::path& path, const Image<std::uint16_t>& labels);

}  // namespace tribin
