#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tribin::io {

/// Unpacks LZF (Marc Lehmann's format, as in PCD binary_compressed).
/// \return the offset in `packed` where it goes wrong, or npos when exactly `unpacked.size()` bytes came out.
std::size_t unpack_lzf(std::string_view packed, std::string& unpacked);

/// LZF packs a run of at most 264 bytes into 3: what a packed file can hold at most.
inline constexpr std::size_t kLzfMostRatio = 88;

}  // namespace tribin::io
