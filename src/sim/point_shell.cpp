#include "sim/point_shell.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_set>

#include "tribin/cad/measure.hpp"

namespace tribin::sim {
namespace {

constexpr int kLeaf = 8;
constexpr double kFiner = 2.5;  // along edges
const double kSharp = std::cos(20 * kDegree);

/// Keeps at most one point in each cube of a grid.
class Thinning {
 public:
  Thinning(const Vec3& origin, double cell) : origin_(origin), cell_(cell) {}
  bool insert(const Vec3& p) { return seen_.insert(key(p)).second; }
  bool has(const Vec3& p) const { return seen_.contains(key(p)); }

 private:
  std::uint64_t key(const Vec3& p) const {
    std::uint64_t k = 0;
    for (int i = 0; i < 3; ++i)
      k = k << 20 | static_cast<std::uint64_t>(std::lround(std::floor((p[i] - origin_[i]) / cell_)));
    return k;
  }
  Vec3 origin_;
  double cell_;
  std::unordered_set<std::uint64_t> seen_;  // asked only, never walked
};

struct Edge {
  std::uint32_t a, b, triangle;
};

/// Ends of the edges whose faces meet at more than 20 degrees, or that have one face only.
std::vector<std::array<std::uint32_t, 2>> sharp_edges(const Mesh& mesh) {
  std::vector<Edge> edges;
  std::vector<Vec3> normals;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3f a = mesh.vertices[t[1]] - mesh.vertices[t[0]], b = mesh.vertices[t[2]] - mesh.vertices[t[0]];
    const Vec3 n = a.cast<double>().cross(b.cast<double>());
    normals.push_back(n.norm() > 0 ? Vec3(n.normalized()) : Vec3(Vec3::Zero()));
    for (int k = 0; k < 3; ++k) edges.push_back({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3]), i});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) {
    return std::tie(x.a, x.b, x.triangle) < std::tie(y.a, y.b, y.triangle);
  });
  std::vector<std::array<std::uint32_t, 2>> sharp;
  for (std::size_t i = 0, j; i < edges.size(); i = j) {
    for (j = i; j < edges.size() && edges[j].a == edges[i].a && edges[j].b == edges[i].b; ++j) {
    }
    if (j - i != 2 || normals[edges[i].triangle].dot(normals[edges[i + 1].triangle]) < kSharp)
      sharp.push_back({edges[i].a, edges[i].b});
  }
  return sharp;
}

void build_node(PointShell& shell, std::int32_t index, std::int32_t first, std::int32_t last) {
  Vec3f low = shell.points[first], high = low;
  for (std::int32_t i = first; i < last; ++i)
    low = low.cwiseMin(shell.points[i]), high = high.cwiseMax(shell.points[i]);
  PointShell::Node node{0.5f * (low + high), 0, first, last, -1};
  for (std::int32_t i = first; i < last; ++i)
    node.radius = std::max(node.radius, (shell.points[i] - node.centre).norm());
  if (last - first > kLeaf) {
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const std::int32_t middle = first + (last - first) / 2;
    std::nth_element(shell.points.begin() + first, shell.points.begin() + middle, shell.points.begin() + last,
                     [&](const Vec3f& a, const Vec3f& b) {
                       for (int k = 0; k < 3; ++k) {  // a total order: the same tree from the same points
                         const int i = (axis + k) % 3;
                         if (a[i] != b[i]) return a[i] < b[i];
                       }
                       return false;
                     });
    node.child = static_cast<std::int32_t>(shell.nodes.size());
    shell.nodes.resize(shell.nodes.size() + 2);
    build_node(shell, node.child, first, middle);
    build_node(shell, node.child + 1, middle, last);
  }
  shell.nodes[index] = node;
}

}  // namespace

PointShell make_point_shell(const Mesh& mesh) {
  const double spacing = diameter(mesh.vertices) / 40;
  const Vec3 origin = bounding_box(mesh.vertices).min;
  PointShell shell;
  Thinning along_edges(origin, spacing / kFiner), on_faces(origin, spacing);
  const auto add = [&](const Vec3& p) { shell.points.push_back(p.cast<float>()); };
  const auto edges = sharp_edges(mesh);
  for (const auto& edge : edges)
    for (const std::uint32_t end : edge) {
      const Vec3 p = mesh.vertices[end].cast<double>();
      if (along_edges.insert(p)) add(p);
      on_faces.insert(p);
    }
  for (const auto& edge : edges) {
    const Vec3 a = mesh.vertices[edge[0]].cast<double>(), b = mesh.vertices[edge[1]].cast<double>();
    const int steps = static_cast<int>(std::ceil((b - a).norm() / (spacing / kFiner)));
    for (int i = 1; i < steps; ++i) {
      const Vec3 p = a + (b - a) * i / steps;
      if (along_edges.insert(p)) add(p);
      on_faces.insert(p);
    }
  }
  // Vertices first: on a round face they stand out of the chords.
  for (const Vec3f& v : mesh.vertices)
    if (on_faces.insert(v.cast<double>())) add(v.cast<double>());
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), u = mesh.vertices[t[1]].cast<double>() - a,
               w = mesh.vertices[t[2]].cast<double>() - a;
    const int n =
        std::max(1, static_cast<int>(std::ceil(2 * std::max({u.norm(), w.norm(), (u - w).norm()}) / spacing)));
    for (int i = 0; i <= n; ++i)
      for (int k = 0; i + k <= n; ++k) {
        const Vec3 p = a + u * i / n + w * k / n;
        if (on_faces.insert(p)) add(p);
      }
  }
  if (shell.points.empty()) return shell;
  shell.nodes.resize(1);
  build_node(shell, 0, 0, static_cast<std::int32_t>(shell.points.size()));
  return shell;
}

}  // namespace tribin::sim
