#include "tribin/cad/half_edges.hpp"

#include <algorithm>
#include <tuple>

namespace tribin {

std::vector<HalfEdge> sorted_half_edges(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<HalfEdge> out;
  out.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      out.push_back({std::min(a, b), std::max(a, b), t, a < b});
    }
  std::sort(out.begin(), out.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return out;
}

}  // namespace tribin
