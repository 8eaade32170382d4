#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

namespace tribin {

/// Which cells of the scan something explains: one bit a cell, row by row.
struct CellMask {
  std::vector<std::uint64_t> bits;  ///< empty = none
  int count = 0;                    ///< bits that are set

  /// None of so many cells.
  static CellMask none_of(std::size_t cells) {
    CellMask out;
    out.bits.assign((cells + 63) / 64, 0);
    return out;
  }

  void add(std::size_t cell) {
    const std::uint64_t bit = std::uint64_t{1} << (cell % 64);
    count += !(bits[cell / 64] & bit);
    bits[cell / 64] |= bit;
  }

  bool holds(std::size_t cell) const { return cell / 64 < bits.size() && (bits[cell / 64] >> (cell % 64) & 1); }

  int shared(const CellMask& other) const {
    int n = 0;
    for (std::size_t i = 0; i < std::min(bits.size(), other.bits.size()); ++i)
      n += std::popcount(bits[i] & other.bits[i]);
    return n;
  }

  void join(const CellMask& other) {
    if (bits.size() < other.bits.size()) bits.resize(other.bits.size(), 0);
    for (std::size_t i = 0; i < other.bits.size(); ++i) bits[i] |= other.bits[i];
    count = 0;
    for (const std::uint64_t b : bits) count += std::popcount(b);
  }
};

}  // namespace tribin
