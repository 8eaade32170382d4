#pragma once

#include <string>
#include <string_view>

#include "tribin/core/content_hash.hpp"
#include "tribin/part/part.hpp"

namespace tribin {

// A compiled part as bytes, for a cache on one machine; docs/part.md draws the layout. All numbers are little endian:
//
//   0   8  magic "tribpart"
//   8   4  kPartFileVersion
//   12  4  zero
//   16  16 key: what the part was made from, as the caller hashed it
//   32  16 content_hash of the payload
//   48  8  size of the payload
//   56     payload: the fields of Part in the order of part.hpp, each as it stands in memory; a list is its count (8
//          bytes) and its elements, a bool or an enum one byte

inline constexpr std::uint32_t kPartFileVersion = 7;  ///< one more with each change of the layout or of a field's sense

/// The part as bytes that part_from_bytes reads back: equal in every bit.
std::string bytes_of_part(const Part& part, const ContentHash& key);

/// Reads a part back.
/// \throws Error bad_input (place, seen, wanted) for bytes that are no such part, are cut or spoilt, are of another
///               version, or were made from another key; no bytes at all make it read or allocate beyond what is there.
Part part_from_bytes(std::string_view bytes, const ContentHash& key);

}  // namespace tribin
