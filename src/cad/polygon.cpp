#include "tribin/cad/polygon.hpp"

#include <numeric>

namespace tribin {
namespace {

/// Twice the area vector of the polygon (Newell): its direction is the normal, also of one that is not quite flat.
Vec3 area_vector(std::span<const Vec3> corners) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 a = corners[i] - corners[0], b = corners[(i + 1) % corners.size()] - corners[0];
    sum += a.cross(b);
  }
  return sum;
}

double turn(const Vec3& normal, const Vec3& a, const Vec3& b, const Vec3& c) {
  return normal.dot((b - a).cross(c - a));
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const Vec3> corners) {
  constexpr std::size_t kMostCorners = 1024;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const std::size_t n = corners.size();
  if (n < 3) return triangles;
  std::vector<std::uint32_t> left(n);
  std::iota(left.begin(), left.end(), 0u);
  const Vec3 normal = area_vector(corners);
  bool convex = true;
  for (std::size_t i = 0; i < n && convex; ++i) {
    convex = turn(normal, corners[i], corners[(i + 1) % n], corners[(i + 2) % n]) >= 0;
  }
  const auto is_ear = [&](std::size_t i) {
    const std::size_t m = left.size();
    const Vec3 &a = corners[left[(i + m - 1) % m]], &b = corners[left[i]], &c = corners[left[(i + 1) % m]];
    if (turn(normal, a, b, c) <= 0) return false;
    for (std::uint32_t k : left) {
      const Vec3& p = corners[k];
      if (p == a || p == b || p == c) continue;
      if (turn(normal, a, b, p) >= 0 && turn(normal, b, c, p) >= 0 && turn(normal, c, a, p) >= 0) return false;
    }
    return true;
  };
  std::size_t at = 0, failed = 0;
  while (!convex && n <= kMostCorners && left.size() > 3 && failed < left.size()) {
    at %= left.size();
    if (!is_ear(at)) {
      ++at;
      ++failed;
      continue;
    }
    const std::size_t m = left.size();
    triangles.push_back({left[(at + m - 1) % m], left[at], left[(at + 1) % m]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
    failed = 0;
  }
  for (std::size_t i = 1; i + 1 < left.size(); ++i) triangles.push_back({left[0], left[i], left[i + 1]});
  return triangles;
}

}  // namespace tribin
