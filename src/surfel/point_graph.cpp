#include "surfel/point_graph.hpp"

#include <algorithm>
#include <cmath>

namespace tribin::surfel_detail {
namespace {

struct GraphEdge {
  float turn;  ///< 1 - |dot of the normals|
  std::uint32_t a, b;
};

void flip(Surfels& s, std::uint32_t i) {
  s.normal[i] = -s.normal[i];
  s.curvature1[i] = -s.curvature1[i];
  s.curvature2[i] = -s.curvature2[i];
}

std::vector<GraphEdge> edges_of(const Surfels& s, const std::vector<std::vector<std::uint32_t>>& near) {
  std::vector<GraphEdge> out;
  out.reserve(8 * s.size());
  for (std::uint32_t i = 0; i < s.size(); ++i)
    for (std::uint32_t j : near[i]) {
      const bool known = s.sigma_normal[i] < kUnknownNormal && s.sigma_normal[j] < kUnknownNormal;
      const float turn = known ? 1 - std::abs(s.normal[i].dot(s.normal[j])) : 1.0f;
      if (i != j) out.push_back({turn, std::min(i, j), std::max(i, j)});
    }
  std::sort(out.begin(), out.end(), [](const GraphEdge& x, const GraphEdge& y) {
    if (x.turn != y.turn) return x.turn < y.turn;
    return x.a != y.a ? x.a < y.a : x.b < y.b;
  });
  return out;
}

/// Whether j, seen from i, keeps or changes its side. Two tangent planes of one arc meet half way: their normals are
/// mirrored in the bisector of the chord, so that it is the reflected normal that must agree.
bool agree(const Surfels& s, std::uint32_t i, std::uint32_t j) {
  Vec3f mirrored = s.normal[i];
  const Vec3f chord = s.position[j] - s.position[i];
  const float length2 = chord.squaredNorm();
  if (length2 > 0) mirrored -= chord * (2 * mirrored.dot(chord) / length2);
  const float turned = mirrored.dot(s.normal[j]);
  const float plain = s.normal[i].dot(s.normal[j]);
  return std::abs(turned) > std::abs(plain) ? turned > 0 : plain > 0;
}

}  // namespace

void orient_normals(Surfels& s, const std::vector<std::vector<std::uint32_t>>& near,
                    const std::optional<Vec3>& viewpoint) {
  if (viewpoint) {
    for (std::uint32_t i = 0; i < s.size(); ++i)
      if (s.normal[i].cast<double>().dot(*viewpoint - s.position[i].cast<double>()) < 0) flip(s, i);
    return;
  }
  std::vector<std::uint32_t> root(s.size());
  for (std::uint32_t i = 0; i < root.size(); ++i) root[i] = i;
  const auto find = [&](std::uint32_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  std::vector<std::vector<std::uint32_t>> tree(s.size());
  for (const GraphEdge& e : edges_of(s, near)) {
    const std::uint32_t a = find(e.a), b = find(e.b);
    if (a == b) continue;
    root[std::max(a, b)] = std::min(a, b);
    tree[e.a].push_back(e.b);
    tree[e.b].push_back(e.a);
  }
  // The outermost point of each piece, among those whose normal is along the axis that they are outermost in.
  std::vector<std::uint32_t> outermost(s.size(), 0);
  std::vector<float> height(s.size(), -1e30f);
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    const std::uint32_t r = find(i);
    const bool known = s.sigma_normal[i] < kUnknownNormal;
    const float up = s.position[i].z() + (known ? 0.0f : -1e20f);
    if (up > height[r] || (up == height[r] && std::abs(s.normal[i].z()) > std::abs(s.normal[outermost[r]].z()))) {
      height[r] = up;
      outermost[r] = i;
    }
  }
  std::vector<std::uint32_t> queue;
  std::vector<std::uint8_t> seen(s.size(), 0);
  for (std::uint32_t r = 0; r < s.size(); ++r) {
    if (find(r) != r) continue;
    const std::uint32_t first = outermost[r];
    if (s.normal[first].z() < 0) flip(s, first);
    queue.assign(1, first);
    seen[first] = 1;
    for (std::size_t at = 0; at < queue.size(); ++at)
      for (std::uint32_t j : tree[queue[at]]) {
        if (seen[j]) continue;
        seen[j] = 1;
        if (!agree(s, queue[at], j)) flip(s, j);
        queue.push_back(j);
      }
  }
}

void connect_points(Surfels& s, const std::vector<std::vector<std::uint32_t>>& near) {
  const auto touching = [&](std::uint32_t i, std::uint32_t j) {
    if (s.sigma_normal[i] >= kUnknownNormal || s.sigma_normal[j] >= kUnknownNormal) return true;
    Vec3f other = s.normal[j];
    if (s.normal[i].dot(other) < 0) other = -other;
    if (s.normal[i].dot(other) < 0.9f) return true;  // 26 deg: a crease, where planes do not meet half way
    const Vec3f chord = s.position[j] - s.position[i];
    const double length = chord.norm();
    const double step = 0.5 * std::abs((s.normal[i] + other).dot(chord));
    const double tilt = 0.5 * length * std::hypot(s.sigma_normal[i], s.sigma_normal[j]);
    // 0.1: uneven sampling of tight radii leaves that share of the chord.
    return step < 0.1 * length + 4.0 * std::hypot(s.sigma_mm[i], s.sigma_mm[j], tilt);
  };
  std::vector<std::vector<std::uint32_t>> both(s.size());
  for (std::uint32_t i = 0; i < s.size(); ++i)
    for (std::uint32_t j : near[i])
      if (i != j && touching(i, j)) {
        both[i].push_back(j);
        both[j].push_back(i);
      }
  s.neighbour_begin.assign(1, 0);
  s.neighbours.clear();
  for (std::vector<std::uint32_t>& list : both) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    s.neighbours.insert(s.neighbours.end(), list.begin(), list.end());
    s.neighbour_begin.push_back(static_cast<std::uint32_t>(s.neighbours.size()));
  }
}

}  // namespace tribin::surfel_detail
