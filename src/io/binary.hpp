#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

namespace tribin::io {

/// A value at an address without alignment, its bytes turned where the file's order is not ours.
template <class T>
T load(const char* at, bool swapped = false) {
  unsigned char bytes[sizeof(T)];
  std::memcpy(bytes, at, sizeof(T));
  if (swapped) {
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  }
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

inline constexpr bool kBigEndianHost = std::endian::native == std::endian::big;

enum class Scalar : std::uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

constexpr std::size_t size_of(Scalar type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<int>(type)];
}

inline double load_scalar(const char* at, Scalar type, bool swapped) {
  switch (type) {
    case Scalar::i8:
      return load<std::int8_t>(at);
    case Scalar::u8:
      return load<std::uint8_t>(at);
    case Scalar::i16:
      return load<std::int16_t>(at, swapped);
    case Scalar::u16:
      return load<std::uint16_t>(at, swapped);
    case Scalar::i32:
      return load<std::int32_t>(at, swapped);
    case Scalar::u32:
      return load<std::uint32_t>(at, swapped);
    case Scalar::i64:
      return static_cast<double>(load<std::int64_t>(at, swapped));
    case Scalar::u64:
      return static_cast<double>(load<std::uint64_t>(at, swapped));
    case Scalar::f32:
      return load<float>(at, swapped);
    default:
      return load<double>(at, swapped);
  }
}

/// Appends the bytes of a value, little endian hosts only (all that Debian's amd64 and arm64 are).
template <class T, class Out>
void append(Out& out, const T& value) {
  static_assert(!kBigEndianHost);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace tribin::io
