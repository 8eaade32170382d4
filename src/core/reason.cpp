#include "tribin/core/reason.hpp"

#include <cmath>

namespace tribin {

void add_reason(std::vector<Reason>& reasons, const Reason& reason) {
  for (Reason& r : reasons) {
    if (r.part != reason.part || r.stage != reason.stage || r.test != reason.test) continue;
    const int count = r.count + reason.count;
    if (std::abs(reason.value - reason.limit) < std::abs(r.value - r.limit)) r = reason;
    r.count = count;
    return;
  }
  reasons.push_back(reason);
}

}  // namespace tribin
