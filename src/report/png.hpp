#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tribin/core/image.hpp"

namespace tribin::report {

using Rgb = std::array<std::uint8_t, 3>;

/// A palette image as PNG bytes; index 0 is transparent. At most 256 colours.
std::string png_of(const Image<std::uint8_t>& indices, const std::vector<Rgb>& palette);
/// 16-bit grey.
std::string png_of(const Image<std::uint16_t>& grey);

}  // namespace tribin::report
