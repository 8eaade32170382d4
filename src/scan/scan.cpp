#include "tribin/scan/scan.hpp"

#include <cmath>

namespace tribin {

std::size_t valid_count(const Scan& scan) {
  std::size_t count = 0;
  for (float z : scan.z_mm.data) count += std::isfinite(z);
  return count;
}

}  // namespace tribin
