#pragma once

#include <cstdint>
#include <string>

#include "io/file_bytes.hpp"
#include "tribin/core/image.hpp"

namespace tribin::io {

/// Decodes a 16-bit grey PNG.
/// \throws Error bad_input for anything else, naming what the header says.
Image<std::uint16_t> decode_png16(const FileBytes& file);

/// Encodes a 16-bit grey PNG.
std::string encode_png16(const Image<std::uint16_t>& image);

}  // namespace tribin::io
