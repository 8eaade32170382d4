#pragma once

#include <cmath>

#include "tribin/cad/mesh.hpp"

namespace tribin::test {

/// Adds the triangles of a box between two corners, wound outward, each with vertices of its own as STL has them.
inline void add_box(Mesh& mesh, const Vec3f& low, const Vec3f& high) {
  constexpr int kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const auto corner = [&](int i) {
    return Vec3f(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z());
  };
  for (const auto& quad : kQuads) {
    for (const auto& [a, b, c] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (int i : {a, b, c}) mesh.vertices.push_back(corner(quad[i]));
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
  }
}

}  // namespace tribin::test
