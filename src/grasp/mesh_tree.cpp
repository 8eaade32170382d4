#include "mesh_tree.hpp"

#include <algorithm>

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
  const auto grow = [this](std::uint32_t triangle, Vec3& low, Vec3& high) {
    for (const Vec3& corner : corners_[triangle]) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  };
  tree_ = make_box_tree(centers, grow, kLeaf);
  // Rays along an edge run in the face of a box: rounding must not put them outside.
  constexpr double kRounding_mm = 1e-6;
  for (Node& node : tree_.nodes) {
    node.low.array() -= kRounding_mm;
    node.high.array() += kRounding_mm;
  }
}

std::optional<MeshHit> MeshTree::first_hit(const Vec3& origin, const Vec3& direction, double reach) const {
  const Vec3 inverse = direction.cwiseInverse();
  std::optional<MeshHit> best;
  double least = reach;
  std::uint32_t stack[64];
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = tree_.nodes[stack[--depth]];
    if (enters(node.low, node.high, origin, inverse, least) > least) continue;
    if (node.right != 0) {
      const std::uint32_t left = static_cast<std::uint32_t>(&node - tree_.nodes.data()) + 1;
      stack[depth++] = node.right;
      stack[depth++] = left;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      // \source Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection" (1997).
      const auto& c = corners_[tree_.order[i]];
      const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0], p = direction.cross(e2);
      const double det = e1.dot(p);
      if (det == 0) continue;
      const Vec3 s = origin - c[0], q = s.cross(e1);
      const double u = s.dot(p) / det, v = direction.dot(q) / det, t = e2.dot(q) / det;
      // Rays through an edge meet one of its triangles at least.
      constexpr double kEdge = 1e-9;
      if (u < -kEdge || v < -kEdge || u + v > 1 + kEdge || t < 0) continue;
      if (t < least || (t == least && best && tree_.order[i] < best->triangle)) {
        least = t;
        best = MeshHit{t, tree_.order[i]};
      }
    }
  }
  return best;
}

bool MeshTree::inside(const Vec3& point) const {
  // A direction that no CAD surface is parallel to.
  const Vec3 direction = Vec3(0.2113, 0.4517, 0.8668).normalized();
  const double reach = (tree_.nodes[0].high - tree_.nodes[0].low).norm() + (point - tree_.nodes[0].low).norm();
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
  stack[depth++] = {0, node_gap(tree_.nodes[0])};
  while (depth > 0 && least > 0) {
    const Visit visit = stack[--depth];
    if (visit.gap >= least) continue;
    const Node& node = tree_.nodes[visit.node];
    if (node.right == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        if (normals_[tree_.order[i]].isZero()) continue;
        least = std::min(least, triangle_gap(tree_.order[i], body, least));
      }
      continue;
    }
    Visit near{visit.node + 1, node_gap(tree_.nodes[visit.node + 1])},
        far{node.right, node_gap(tree_.nodes[node.right])};
    if (far.gap < near.gap) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  return least;
}

}  // namespace tribin::grasp
