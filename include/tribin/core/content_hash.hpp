#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace tribin {

/// 128 bits that name a content: different bytes give different ones but for chance (1e-20 for a million files). It
/// guards against accidents, not against people who want a clash.
using ContentHash = std::array<std::uint64_t, 2>;

/// \source MurmurHash3_x64_128 by A. Appleby (public domain). \cost 0.4 ms a megabyte.
ContentHash content_hash(std::string_view bytes, std::uint64_t seed = 0);

/// 32 hexadecimal digits.
std::string hex_of(const ContentHash& hash);

}  // namespace tribin
