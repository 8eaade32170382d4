#pragma once

#include <cstdint>
#include <string>

#include "io/file_bytes.hpp"
#include "tribin/core/image.hpp"

namespace tribin::io {

/// Decodes a 16-bit grey PNG.
/// \throws Error bad_input for anything else, naming what the header says.
Image<std::uint16_t> decode_png16(const FileBytes& file);

/// A grey image of 8 or 16 bit: one of the two is filled.
struct GreyImage {
  Image<std::uint8_t> grey8;
  Image<std::uint16_t> grey16;
};

/// Decodes a grey PNG of 8 or 16 bit.
/// \throws Error bad_input for anything else, naming what the header says.
GreyImage decode_grey_png(const FileBytes& file);

/// Encodes an 8-bit grey PNG.
std::string encode_png8(const Image<std::uint8_t>& image);

/// Encodes a 16-bit grey PNG.
std::string encode_png16(const Image<std::uint16_t>& image);

/// Encodes a 16-bit RGB PNG from an image of three times the width: red, green, blue of each pixel in turn.
std::string encode_png16_rgb(const Image<std::uint16_t>& interleaved);

}  // namespace tribin::io
