#include "solid.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/cad/nearest.hpp"

namespace tribin {

Solid::Solid(std::span<const Vec3f> vertices, std::span<const std::array<std::uint32_t, 3>> triangles) {
  constexpr std::uint32_t kLeaf = 4;
  std::vector<Vec3> middles;
  for (const auto& t : triangles) {
    const Vec3 a = vertices[t[0]].cast<double>(), b = vertices[t[1]].cast<double>(), c = vertices[t[2]].cast<double>();
    triangles_.push_back({a, Vec3(b - a), Vec3(c - a)});
    middles.push_back((a + b + c) / 3);
  }
  const auto grow = [&](std::uint32_t i, Vec3& low, Vec3& high) {
    const auto& t = triangles_[i];
    for (const Vec3& p : {t[0], Vec3(t[0] + t[1]), Vec3(t[0] + t[2])}) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  };
  tree_ = make_box_tree(middles, grow, kLeaf);
}

bool Solid::inside(const Vec3& point) const {
  // The first facet along a direction that no CAD surface is parallel to: left from within, or from outside?
  const Vec3 along = Vec3(0.2113, 0.4517, 0.8668).normalized();
  const Vec3 inverse = along.cwiseInverse();
  double nearest = 1e300, side = -1;
  visit(
      tree_,
      [&](const auto& node) {
        const Vec3 enter = (node.low - point).cwiseProduct(inverse), leave = (node.high - point).cwiseProduct(inverse);
        return std::max(0.0, enter.maxCoeff()) <= std::min(nearest, leave.minCoeff());
      },
      [&](std::uint32_t triangle) {
        // \source Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection" (1997).
        const auto& [a, ab, ac] = triangles_[triangle];
        const Vec3 p = along.cross(ac);
        const double det = ab.dot(p);
        if (det == 0) return;
        const Vec3 s = point - a, q = s.cross(ab);
        const double u = s.dot(p) / det, v = along.dot(q) / det, t = ac.dot(q) / det;
        if (u < 0 || v < 0 || u + v > 1 || t < 0 || t >= nearest) return;
        nearest = t;
        side = ab.cross(ac).dot(along);
      });
  return side > 0;
}

std::optional<Solid::Depth> Solid::depth(const Vec3& point, const Vec3& normal) const {
  constexpr double kAgainst = -0.5;  // within 60 deg
  if (tree_.nodes.empty() || (point.array() < low().array()).any() || (point.array() > high().array()).any() ||
      !inside(point))
    return {};
  double least2 = 1e300;
  Depth out;
  visit(
      tree_,
      [&](const auto& node) {
        return (node.low - point).cwiseMax(point - node.high).cwiseMax(Vec3::Zero()).squaredNorm() < least2;
      },
      [&](std::uint32_t triangle) {
        const auto& [a, ab, ac] = triangles_[triangle];
        const Vec3 facet = ab.cross(ac);
        if (facet.dot(normal) > kAgainst * facet.norm()) return;
        const Vec3 at = nearest_on_triangle(a, ab, ac, point);
        const double distance2 = (at - point).squaredNorm();
        if (distance2 >= least2) return;
        least2 = distance2;
        out.outward = at - point;
      });
  out.mm = std::sqrt(least2);
  if (least2 == 1e300 || out.mm < 1e-6) return {};
  out.outward /= out.mm;
  return out;
}

}  // namespace tribin
