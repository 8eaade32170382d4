#include "cad/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

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

TriangleTree::TriangleTree(const Mesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<Vec3f> centers;
  centers.reserve(order_.size());
  for (const auto& t : mesh.triangles) {
    centers.push_back((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3);
  }
  if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()), centers);
}

std::uint32_t TriangleTree::build(std::uint32_t begin, std::uint32_t end, const std::vector<Vec3f>& centers) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::infinity()), high = -low, first = low, last = high;
  for (std::uint32_t i = begin; i < end; ++i) {
    for (std::uint32_t corner : mesh_.triangles[order_[i]]) {
      low = low.cwiseMin(mesh_.vertices[corner]);
      high = high.cwiseMax(mesh_.vertices[corner]);
    }
    first = first.cwiseMin(centers[order_[i]]);
    last = last.cwiseMax(centers[order_[i]]);
  }
  nodes_[index] = {low, high, begin, end, 0};
  if (end - begin <= kLeaf) return index;
  int axis = 0;
  (last - first).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return centers[a][axis] != centers[b][axis] ? centers[a][axis] < centers[b][axis] : a < b;
                   });
  build(begin, middle, centers);
  const std::uint32_t right = build(middle, end, centers);
  nodes_[index].right = right;
  return index;
}

void TriangleTree::cross(const Vec3& origin, const Vec3& direction, std::vector<std::uint32_t>& crossed) const {
  crossed.clear();
  if (nodes_.empty()) return;
  const Vec3 inverse = direction.cwiseInverse();
  std::array<std::uint32_t, 64> stack;  // halves of at most 2^32 triangles
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    if (!reaches(node.low, node.high, origin, inverse)) continue;
    if (node.right) {
      stack[top++] = node.right;
      stack[top++] = static_cast<std::uint32_t>(&node - nodes_.data()) + 1;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      if (crosses(mesh_, mesh_.triangles[order_[i]], origin, direction)) crossed.push_back(order_[i]);
    }
  }
}

}  // namespace tribin
