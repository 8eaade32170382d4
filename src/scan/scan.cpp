#include "tribin/scan/scan.hpp"

#include <cmath>

namespace tribin {

std::string_view name_of(Invalid reason) {
  static constexpr std::string_view kNames[kInvalidReasons] = {
      "measured",      "nothing_there",      "shadow",    "dark",       "grazing", "saturated", "lost",
      "uncertain_bit", "order_inconsistent", "unmatched", "out_of_view"};
  return kNames[static_cast<int>(reason)];
}

std::size_t valid_count(const Scan& scan) {
  std::size_t count = 0;
  for (float z : scan.z_mm.data) count += std::isfinite(z);
  return count;
}

}  // namespace tribin
