#include "tribin/core/thin_points.hpp"

#include <cmath>
#include <unordered_map>

namespace tribin {
namespace {

std::uint64_t key_of(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::int64_t kOffset = 1 << 20;
  constexpr std::uint64_t kMask = (1u << 21) - 1;
  return (static_cast<std::uint64_t>(x + kOffset) & kMask) << 42 |
         (static_cast<std::uint64_t>(y + kOffset) & kMask) << 21 | (static_cast<std::uint64_t>(z + kOffset) & kMask);
}

}  // namespace

std::vector<std::uint32_t> thin_points(std::span<const Vec3f> points, std::span<const Vec3f> normals,
                                       double spacing_mm) {
  const auto inverse = static_cast<float>(1 / spacing_mm), square = static_cast<float>(spacing_mm * spacing_mm);
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>>
      boxes;  // of the spacing's side: looked up, never listed
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Vec3f &p = points[i], &n = normals[i];
    const auto x = static_cast<std::int64_t>(std::floor(p[0] * inverse)),
               y = static_cast<std::int64_t>(std::floor(p[1] * inverse)),
               z = static_cast<std::int64_t>(std::floor(p[2] * inverse));
    bool free = true;
    for (int k = 0; k < 27 && free; ++k) {
      const auto box = boxes.find(key_of(x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1));
      if (box == boxes.end()) continue;
      for (const std::uint32_t j : box->second)
        free = free && !((points[j] - p).squaredNorm() < square && normals[j].dot(n) > 0.5f);
    }
    if (!free) continue;
    boxes[key_of(x, y, z)].push_back(i);
    out.push_back(i);
  }
  return out;
}

}  // namespace tribin
