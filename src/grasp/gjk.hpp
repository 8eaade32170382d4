#pragma once

#include <Eigen/Core>
#include <cmath>

// The distance of two convex sets from their support functions.
namespace tribin::grasp::gjk {

using V = Eigen::Vector3d;

/// Up to four points of the difference of two sets; reduced to those that hold the point nearest to the origin.
class Simplex {
 public:
  void add(const V& p) { points_[count_++] = p; }
  int count() const { return count_; }
  bool has(const V& p) const {
    for (int i = 0; i < count_; ++i)
      if (points_[i] == p) return true;
    return false;
  }
  /// Keeps the face that is nearest to the origin. \return its nearest point; zero where the origin lies inside.
  V reduce() {
    switch (count_) {
      case 1:
        return points_[0];
      case 2:
        return keep(nearest_of_edge(0, 1));
      case 3:
        return keep(nearest_of_triangle(0, 1, 2));
      default:
        return keep(nearest_of_tetrahedron());
    }
  }

 private:
  struct Nearest {
    V point = V::Zero();
    int ids[4] = {0, 0, 0, 0};
    int count = 0;
  };

  V keep(const Nearest& n) {
    V kept[4];
    for (int i = 0; i < n.count; ++i) kept[i] = points_[n.ids[i]];
    for (int i = 0; i < n.count; ++i) points_[i] = kept[i];
    count_ = n.count;
    return n.point;
  }

  Nearest nearest_of_edge(int a, int b) const {
    const V& p = points_[a];
    const V along = points_[b] - p;
    const double t = -p.dot(along), length = along.squaredNorm();
    if (t <= 0 || length == 0) return {p, {a}, 1};
    if (t >= length) return {points_[b], {b}, 1};
    return {p + along * (t / length), {a, b}, 2};
  }

  /// \source Ericson, "Real-Time Collision Detection" (2005), section 5.1.5, with the origin as the point.
  Nearest nearest_of_triangle(int ia, int ib, int ic) const {
    const V &a = points_[ia], &b = points_[ib], &c = points_[ic];
    const V ab = b - a, ac = c - a;
    const double d1 = -ab.dot(a), d2 = -ac.dot(a), d3 = -ab.dot(b), d4 = -ac.dot(b), d5 = -ab.dot(c), d6 = -ac.dot(c);
    if (d1 <= 0 && d2 <= 0) return {a, {ia}, 1};
    if (d3 >= 0 && d4 <= d3) return {b, {ib}, 1};
    if (d6 >= 0 && d5 <= d6) return {c, {ic}, 1};
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return nearest_of_edge(ia, ib);
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return nearest_of_edge(ia, ic);
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return nearest_of_edge(ib, ic);
    const double sum = va + vb + vc;
    if (!(sum > 0)) return nearest_of_edge(ia, ib);  // three points on a line
    return {a + ab * (vb / sum) + ac * (vc / sum), {ia, ib, ic}, 3};
  }

  Nearest nearest_of_tetrahedron() const {
    constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
    Nearest best;
    double least = 0;
    bool inside = true;
    for (const auto& f : kFaces) {
      const V &a = points_[f[0]], normal = (points_[f[1]] - a).cross(points_[f[2]] - a);
      const double origin = -normal.dot(a), apex = normal.dot(points_[f[3]] - a);
      // Flat tetrahedra enclose nothing: each face is looked at.
      if (origin * apex > 0 && std::abs(apex) > 1e-12 * normal.norm()) continue;
      inside = false;
      const Nearest n = nearest_of_triangle(f[0], f[1], f[2]);
      const double d = n.point.squaredNorm();
      if (best.count == 0 || d < least) {
        best = n;
        least = d;
      }
    }
    if (inside) return {V::Zero(), {0, 1, 2, 3}, 4};
    return best;
  }

  V points_[4];
  int count_ = 0;
};

/// The distance of two sets A and B; 0 where they overlap.
/// \param difference  the point of A - B that lies farthest along a direction
/// \param start       any point of A - B, or the difference of two points near them
/// \param enough      above it a lower bound will do
/// \source Gilbert, Johnson, Keerthi, "A fast procedure for computing the distance between complex objects in
///         three-dimensional space" (1988).
template <class Difference>
double distance(const Difference& difference, const V& start, double enough) {
  // The duality gap at which the distance is known to a nanometre or to 1e-9 of itself.
  constexpr double kGap = 1e-9;
  V nearest = start;
  if (nearest.squaredNorm() == 0) nearest = V::UnitX();
  Simplex simplex;
  double lower = 0;
  for (int i = 0; i < 64; ++i) {
    const double length = nearest.norm();
    const V w = difference(-nearest);
    const double bound = nearest.dot(w) / length;
    lower = std::max(lower, bound);
    if (lower > enough) return lower;
    if (simplex.count() > 0 && (length - bound <= kGap * (1 + length) || simplex.has(w))) return length;
    simplex.add(w);
    nearest = simplex.reduce();
    if (simplex.count() == 4 || nearest.squaredNorm() < kGap * kGap) return 0;
  }
  return lower;
}

}  // namespace tribin::grasp::gjk
