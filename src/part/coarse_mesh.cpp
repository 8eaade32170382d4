#include "coarse_mesh.hpp"

#include <meshoptimizer.h>

namespace tribin {

Mesh coarse_mesh(const Mesh& mesh, double error_mm) {
  if (mesh.triangles.empty()) return mesh;
  const unsigned* indices = mesh.triangles[0].data();
  const std::size_t count = 3 * mesh.triangles.size();
  const float* points = mesh.vertices[0].data();
  const std::size_t vertices = mesh.vertices.size();
  constexpr std::size_t kStride = sizeof(Vec3f);
  const float extent = meshopt_simplifyScale(points, vertices, kStride);
  std::vector<unsigned> kept(count);
  kept.resize(meshopt_simplify(kept.data(), indices, count, points, vertices, kStride, 0,
                               extent > 0 ? static_cast<float>(error_mm) / extent : 0, 0, nullptr));
  if (kept.empty()) return mesh;  // thinner than the error

  Mesh out = mesh;
  out.face_of_triangle.clear();
  out.triangles.clear();
  out.vertices.clear();
  std::vector<std::uint32_t> number(vertices, ~0u);
  for (std::size_t k = 0; k < kept.size(); k += 3) {
    std::array<std::uint32_t, 3> triangle;
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint32_t& to = number[kept[k + c]];
      if (to == ~0u) {
        to = static_cast<std::uint32_t>(out.vertices.size());
        out.vertices.push_back(mesh.vertices[kept[k + c]]);
      }
      triangle[c] = to;
    }
    out.triangles.push_back(triangle);
  }
  return out;
}

}  // namespace tribin
