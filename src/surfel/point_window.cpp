#include "surfel/point_window.hpp"

#include <algorithm>
#include <cmath>

namespace tribin::surfel_detail {
namespace {

constexpr std::size_t kTriples = 10;  // of the nearest points, all pairs with the point itself
// The tightest radius that points can follow is three times their distance: a sixth of the square of the distance,
// in distances. A tenth more for noise.
constexpr double kBend = 1.0 / 6.0, kNoise = 0.1;
constexpr std::size_t kPlanePoints = 5, kQuadricPoints = 9;  // 3 and 6 coefficients, and some to judge them by

/// What a point at this squared distance may lie off the tangent plane.
double allowance(double distance2, double spacing) { return kNoise * spacing + kBend * distance2 / spacing; }

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

constexpr std::size_t kMost = 32;  // neighbours that triples are judged by

/// Offsets of the neighbours from the point itself, and how far each may lie off.
struct Offsets {
  Vec3f at[kMost];
  float limit[kMost];
  std::size_t count = 0;
};

/// Normal of the plane through the point and two of its neighbours that most others are near to; zero where all lie on
/// a line.
Vec3f best_plane(const Offsets& o) {
  Vec3f best = Vec3f::Zero();
  float least = 1e30f;
  const std::size_t triples = std::min(o.count, kTriples);
  for (std::size_t a = 1; a < triples; ++a)
    for (std::size_t b = a + 1; b < triples; ++b) {
      const Vec3f across = o.at[a].cross(o.at[b]);
      const float length = across.norm();
      if (length < 0.3f * o.at[a].norm() * o.at[b].norm()) continue;  // 17 deg: next to a line
      const Vec3f normal = across / length;
      float cost = 0;
      for (std::size_t i = 1; i < o.count && cost < least; ++i) {
        const float r = normal.dot(o.at[i]) / o.limit[i];
        cost += std::min(1.0f, r * r);
      }
      if (cost < least) least = cost, best = normal;
    }
  return best;
}

}  // namespace

PointWindow smallest_window(std::span<const Vec3f> points, std::span<const std::uint32_t> near, double spacing) {
  PointWindow out;
  if (near.size() < kPlanePoints || !(spacing > 0)) return out;
  const Vec3f origin = points[near[0]];
  Offsets o;
  o.count = std::min(near.size(), kMost);
  for (std::size_t i = 0; i < o.count; ++i) {
    o.at[i] = points[near[i]] - origin;
    o.limit[i] = static_cast<float>(allowance(o.at[i].squaredNorm(), spacing));
  }
  const Vec3f best = best_plane(o);
  if (best.isZero()) return out;
  std::vector<std::uint32_t> chosen;
  for (std::size_t i = 0; i < o.count; ++i)
    if (std::abs(best.dot(o.at[i])) <= o.limit[i]) chosen.push_back(near[i]);

  std::vector<double> residuals;
  constexpr int kRounds = 4;  // a choice cut at 1 sigma comes back to 3 in that many
  for (int round = 0; round < kRounds; ++round) {
    out.bends = chosen.size() >= kQuadricPoints;
    const PointQuadric q = out.bends ? fit_point_quadric(points, chosen) : fit_point_plane(points, chosen);
    if (!q.valid()) {
      out.quadric = PointQuadric();
      return out;
    }
    out.quadric = q;
    residuals.clear();
    for (std::uint32_t i : chosen) residuals.push_back(std::abs(q.misfit(points[i].cast<double>())));
    const double freedom = static_cast<double>(chosen.size()) - (out.bends ? 6.0 : 3.0);
    const double scale = 1.4826 * median(residuals) * std::sqrt(static_cast<double>(chosen.size()) / freedom);
    const double reach = std::max(3.0 * scale, 1e-3 * spacing);
    std::vector<std::uint32_t> next;
    for (std::size_t i = 0; i < o.count; ++i) {
      const double off = std::abs(q.misfit(points[near[i]].cast<double>()));
      if (i == 0 || off <= std::min<double>(reach, 2.0 * o.limit[i])) next.push_back(near[i]);
    }
    if (next == chosen || next.size() < kPlanePoints) break;
    chosen = std::move(next);
  }
  return out;
}

PointWindow flat_or(const PointWindow& bent, std::span<const Vec3f> points, std::span<const std::uint32_t> near,
                    double sigma) {
  constexpr double kMostOf = 0.75;
  if (!bent.bends || near.size() < kQuadricPoints) return bent;
  Offsets o;
  o.count = std::min(near.size(), kMost);
  for (std::size_t i = 0; i < o.count; ++i) {
    o.at[i] = points[near[i]] - points[near[0]];
    o.limit[i] = static_cast<float>(3.0 * sigma);
  }
  const Vec3f best = best_plane(o);
  std::vector<std::uint32_t> chosen;
  for (std::size_t i = 0; i < o.count; ++i)
    if (std::abs(best.dot(o.at[i])) <= o.limit[i]) chosen.push_back(near[i]);
  for (int round = 0; round < 2; ++round) {
    if (chosen.size() < kQuadricPoints) return bent;
    const PointQuadric plane = fit_point_plane(points, chosen);
    if (!plane.valid()) return bent;
    chosen.clear();
    for (std::size_t i = 0; i < o.count; ++i)
      if (i == 0 || std::abs(plane.misfit(points[near[i]].cast<double>())) <= 3.0 * sigma) chosen.push_back(near[i]);
  }
  if (chosen.size() < kQuadricPoints || static_cast<double>(chosen.size()) < kMostOf * bent.quadric.points) return bent;
  PointWindow out{fit_point_quadric(points, chosen), true};
  return out.quadric.valid() ? out : bent;
}

PointWindow larger_window(std::span<const Vec3f> points, std::span<const std::uint32_t> near, const PointWindow& from,
                          double sigma) {
  PointWindow out;
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i : near)
    if (i == near[0] || std::abs(from.quadric.misfit(points[i].cast<double>())) <= 4.0 * sigma) chosen.push_back(i);
  if (chosen.size() < kQuadricPoints || static_cast<int>(chosen.size()) <= from.quadric.points) return out;
  out.quadric = fit_point_quadric(points, chosen);
  out.bends = true;
  return out;
}

}  // namespace tribin::surfel_detail
