#pragma once

#include <cmath>
#include <cstdint>

#include "tribin/core/geometry.hpp"

namespace tribin::sim {

/// SplitMix64: the same numbers on every machine, and any place of the sequence at once.
inline std::uint64_t mixed(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15u;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(mixed(seed)) {}
  std::uint64_t bits() { return mixed(state_++ * 0xD1342543DE82EF95u); }
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }  ///< in [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  int integer(int low, int high) {  ///< in [low, high]
    return low + static_cast<int>(bits() % static_cast<std::uint64_t>(high - low + 1));
  }
  double normal() {  ///< standard normal, by Box and Muller
    return std::sqrt(-2 * std::log(1 - uniform())) * std::cos(2 * kPi * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace tribin::sim
