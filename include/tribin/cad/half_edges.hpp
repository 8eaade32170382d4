#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tribin {

/// A triangle's run along one of its edges.
struct HalfEdge {
  std::uint32_t low, high;  ///< the edge's vertices, the smaller number first
  std::uint32_t triangle;
  bool forward;  ///< whether the triangle runs it from low to high
};

/// All half edges, those of one edge side by side in the order of their triangles.
std::vector<HalfEdge> sorted_half_edges(std::span<const std::array<std::uint32_t, 3>> triangles);

/// Calls visit(span of the half edges of one edge) for each edge: two on a closed surface, one on a border.
template <class Visit>
void for_each_edge(std::span<const HalfEdge> sorted, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
    while (end < sorted.size() && sorted[end].low == sorted[begin].low && sorted[end].high == sorted[begin].high) ++end;
    visit(sorted.subspan(begin, end - begin));
  }
}

}  // namespace tribin
