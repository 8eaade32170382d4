#include "io/lzf.hpp"

#include <cstring>

namespace tribin::io {

std::size_t unpack_lzf(std::string_view packed, std::string& unpacked) {
  const std::size_t in_end = packed.size(), out_end = unpacked.size();
  std::size_t in = 0, out = 0;
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(packed[i])); };
  while (in < in_end) {
    const std::size_t begin = in, control = byte(in++);
    if (control < 32) {  // a run of bytes as they are
      const std::size_t length = control + 1;
      if (length > in_end - in || length > out_end - out) return begin;
      std::memcpy(unpacked.data() + out, packed.data() + in, length);
      in += length;
      out += length;
      continue;
    }
    std::size_t length = control >> 5;  // a run that occurred before
    if (length == 7) {
      if (in >= in_end) return begin;
      length += byte(in++);
    }
    length += 2;
    if (in >= in_end) return begin;
    const std::size_t back = ((control & 31) << 8 | byte(in++)) + 1;
    if (back > out || length > out_end - out) return begin;
    char* to = unpacked.data() + out;
    if (back >= length) {
      std::memcpy(to, to - back, length);
    } else {
      for (std::size_t i = 0; i < length; ++i)
        to[i] = to[static_cast<std::ptrdiff_t>(i) - static_cast<std::ptrdiff_t>(back)];
    }
    out += length;
  }
  return out == out_end ? std::string::npos : in_end;
}

}  // namespace tribin::io
