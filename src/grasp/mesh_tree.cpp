#include "mesh_tree.hpp"

#include <algorithm>
#include <numeric>

#include "gjk.hpp"
#include "tribin/core/error.hpp"

namespace tribin::grasp {
namespace {

constexpr std::uint32_t kLeaf = 4;

/// Where a ray enters a box; a number above `reach` where it does not.
double enters(const Vec3& low, const Vec3& high, const Vec3& origin, const Vec3& inverse, double reach) {
  double first = 0, last = reach;
  for (int k = 0; k < 3; ++k) {
    double a = (low[k] - origin[k]) * inverse[k], b = (high[k] - origin[k]) * inverse[k];
    if (a > b) std::swap(a, b);
    // A ray within a face's plane gives NaN, which lets it pass.
    if (a > first) first = a;
    if (b < last) last = b;
  }
  return first <= last ? first : 2 * reach + 1;
}

}  // namespace

MeshTree::MeshTree(const Mesh& mesh) {
  std::vector<Vec3> centers;
  for (const auto& t : mesh.triangles) {
    const std::array<Vec3, 3> c = {mesh.vertices[t[0]].cast<double>(), mesh.vertices[t[1]].cast<double>(),
                                   mesh.vertices[t[2]].cast<double>()};
    const Vec3 across = Vec3(c[1] - c[0]).cross(Vec3(c[2] - c[0]));
    corners_.push_back(c);
    normals_.push_back(across.norm() > 0 ? Vec3(across.normalized()) : Vec3(Vec3::Zero()));
    centers.push_back((c[0] + c[1] + c[2]) / 3);
  }
  TRIBIN_ASSERT(!corners_.empty());
  order_.resize(corners_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  build(0, count(), centers);
}

std::uint32_t MeshTree::build(std::uint32_t begin, std::uint32_t end, const std::vector<Vec3>& centers) {
  const std::uint32_t id = static_cast<std::uint32_t>(nodes_.size());
  Node node{Vec3::Constant(1e300), Vec3::Constant(-1e300), begin, end, 0};
  Vec3 low = node.low, high = node.high;  // of the centres
  for (std::uint32_t i = begin; i < end; ++i) {
    for (const Vec3& corner : corners_[order_[i]]) {
      node.low = node.low.cwiseMin(corner);
      node.high = node.high.cwiseMax(corner);
    }
    low = low.cwiseMin(centers[order_[i]]);
    high = high.cwiseMax(centers[order_[i]]);
  }
  // Rays along an edge run in the face of a box: rounding must not put them outside.
  constexpr double kRounding_mm = 1e-6;
  node.low.array() -= kRounding_mm;
  node.high.array() += kRounding_mm;
  nodes_.push_back(node);
  if (end - begin <= kLeaf) return id;
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return centers[a][axis] != centers[b][axis] ? centers[a][axis] < centers[b][axis] : a < b;
                   });
  build(begin, middle, centers);
  const std::uint32_t right = build(middle, end, centers);
  nodes_[id].right = right;
  return id;
}

std::optional<MeshHit> MeshTree::first_hit(const Vec3& origin, const Vec3& direction, double reach) const {
  const Vec3 inverse = direction.cwiseInverse();
  std::optional<MeshHit> best;
  double least = reach;
  std::uint32_t stack[64];
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (enters(node.low, node.high, origin, inverse, least) > least) continue;
    if (node.right != 0) {
      const std::uint32_t left = static_cast<std::uint32_t>(&node - nodes_.data()) + 1;
      stack[depth++] = node.right;
      stack[depth++] = left;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      // \source Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection" (1997).
      const auto& c = corners_[order_[i]];
      const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0], p = direction.cross(e2);
      const double det = e1.dot(p);
      if (det == 0) continue;
      const Vec3 s = origin - c[0], q = s.cross(e1);
      const double u = s.dot(p) / det, v = direction.dot(q) / det, t = e2.dot(q) / det;
      // Rays through an edge meet one of its triangles at least.
      constexpr double kEdge = 1e-9;
      if (u < -kEdge || v < -kEdge || u + v > 1 + kEdge || t < 0) continue;
      if (t < least || (t == least && best && order_[i] < best->triangle)) {
        least = t;
        best = MeshHit{t, order_[i]};
      }
    }
  }
  return best;
}

bool MeshTree::inside(const Vec3& point) const {
  // A direction that no CAD surface is parallel to.
  const Vec3 direction = Vec3(0.2113, 0.4517, 0.8668).normalized();
  const double reach = (nodes_[0].high - nodes_[0].low).norm() + (point - nodes_[0].low).norm();
  const auto hit = first_hit(point, direction, reach);
  return hit && normals_[hit->triangle].dot(direction) > 0;
}

double MeshTree::triangle_gap(std::uint32_t triangle, const Convex& body, double enough) const {
  const auto& c = corners_[triangle];
  const auto difference = [&](const gjk::V& d) -> gjk::V {
    int far = 0;
    double most = -c[0].dot(d);
    for (int k = 1; k < 3; ++k)
      if (-c[k].dot(d) > most) most = -c[k].dot(d), far = k;
    return support(body, d) - c[far];
  };
  const gjk::V start = body.frame_from_body.translation() + 0.5 * body.sweep_mm - c[0];
  return std::max(0.0, gjk::distance(difference, start, enough + body.radius_mm) - body.radius_mm);
}

double MeshTree::gap_mm(const Convex& body, double enough) const {
  Vec3 low, high;
  for (int k = 0; k < 3; ++k) {
    high[k] = reach_along(body, Vec3::Unit(k));
    low[k] = -reach_along(body, -Vec3::Unit(k));
  }
  double least = enough;
  // First the boxes along the axes, then the body itself against the node's box.
  const auto node_gap = [&](const Node& node) {
    const double axes = (node.low - high).cwiseMax(low - node.high).cwiseMax(Vec3::Zero()).norm();
    if (axes >= least) return axes;
    Convex box;
    box.frame_from_body.translation() = 0.5 * (node.low + node.high);
    box.half_mm = 0.5 * (node.high - node.low);
    return distance_mm(body, box, least);
  };
  struct Visit {
    std::uint32_t node;
    double gap;
  };
  Visit stack[64];
  int depth = 0;
  stack[depth++] = {0, node_gap(nodes_[0])};
  while (depth > 0 && least > 0) {
    const Visit visit = stack[--depth];
    if (visit.gap >= least) continue;
    const Node& node = nodes_[visit.node];
    if (node.right == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        if (normals_[order_[i]].isZero()) continue;
        least = std::min(least, triangle_gap(order_[i], body, least));
      }
      continue;
    }
    Visit near{visit.node + 1, node_gap(nodes_[visit.node + 1])}, far{node.right, node_gap(nodes_[node.right])};
    if (far.gap < near.gap) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  return least;
}

}  // namespace tribin::grasp
