#include "cad/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tribin {
namespace {

constexpr std::uint32_t kLeaf = 8;  // triangles

bool crosses(const Mesh& mesh, const std::array<std::uint32_t, 3>& t, const Vec3& origin, const Vec3& direction) {
  // Moeller & Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
  const Vec3 a = mesh.vertices[t[0]].cast<double>();
  const Vec3 ab = Vec3(mesh.vertices[t[1]].cast<double>()) - a, ac = Vec3(mesh.vertices[t[2]].cast<double>()) - a;
  const Vec3 p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return false;
  const Vec3 to = origin - a;
  const double u = to.dot(p) / determinant;
  if (u < 0 || u > 1) return false;
  const Vec3 q = to.cross(ab);
  const double v = direction.dot(q) / determinant;
  return v >= 0 && u + v <= 1 && ac.dot(q) / determinant > 0;
}

bool reaches(const Vec3f& low, const Vec3f& high, const Vec3& origin, const Vec3& inverse) {
  double near = 0, far = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c) {
    const double a = (low[c] - origin[c]) * inverse[c], b = (high[c] - origin[c]) * inverse[c];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return near <= far * (1 + 1e-12);
}

}  // namespace

TriangleTree::TriangleTree(const Mesh& mesh) : mesh_(mesh) {
  std::vector<Vec3f> middles;
  middles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    middles.push_back((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3);
  const auto grow = [&mesh](std::uint32_t triangle, Vec3f& low, Vec3f& high) {
    for (const std::uint32_t corner : mesh.triangles[triangle]) {
      low = low.cwiseMin(mesh.vertices[corner]);
      high = high.cwiseMax(mesh.vertices[corner]);
    }
  };
  tree_ = make_box_tree(middles, grow, kLeaf);
}

void TriangleTree::cross(const Vec3& origin, const Vec3& direction, std::vector<std::uint32_t>& crossed) const {
  crossed.clear();
  if (tree_.nodes.empty()) return;
  const Vec3 inverse = direction.cwiseInverse();
  std::array<std::uint32_t, 64> stack;  // halves of at most 2^32 triangles
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const BoxTree<Vec3f>::Node& node = tree_.nodes[stack[--top]];
    if (!reaches(node.low, node.high, origin, inverse)) continue;
    if (node.right) {
      stack[top++] = node.right;
      stack[top++] = static_cast<std::uint32_t>(&node - tree_.nodes.data()) + 1;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      if (crosses(mesh_, mesh_.triangles[tree_.order[i]], origin, direction)) crossed.push_back(tree_.order[i]);
    }
  }
}

}  // namespace tribin
