#include "surfel/thin_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "surfel/point_tree.hpp"

namespace tribin::surfel_detail {
namespace {

using Key = std::array<std::int32_t, 3>;

/// Joins the points of equal keys; the order of the result is that of the keys' first points.
ThinPoints join_equal(std::span<const Vec3f> points, const std::vector<Key>& keys) {
  std::vector<std::uint32_t> order(points.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; });
  std::vector<std::uint32_t> first(points.size());  // of the point's group
  for (std::size_t at = 0; at < order.size(); ++at)
    first[order[at]] = at > 0 && keys[order[at]] == keys[order[at - 1]] ? first[order[at - 1]] : order[at];
  ThinPoints out;
  out.of_point.resize(points.size());
  std::vector<Vec3> sum;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (first[i] == i) {
      out.of_point[i] = static_cast<std::uint32_t>(sum.size());
      sum.emplace_back(Vec3::Zero());
      out.points.push_back(0);
    } else {
      out.of_point[i] = out.of_point[first[i]];
    }
    sum[out.of_point[i]] += points[i].cast<double>();
    ++out.points[out.of_point[i]];
  }
  out.position.resize(sum.size());
  for (std::size_t k = 0; k < sum.size(); ++k) out.position[k] = (sum[k] / out.points[k]).cast<float>();
  return out;
}

/// Typical spacing: the median over a sample of the square of area that a point has to itself.
double typical_spacing(std::span<const Vec3f> points) {
  constexpr std::size_t kNear = 8, kSample = 1000;
  const PointTree tree(points);
  std::vector<std::uint32_t> near;
  std::vector<double> areas;
  for (std::size_t i = 0; i < points.size(); i += 1 + points.size() / kSample) {
    tree.nearest(points[i], kNear + 1, near);
    areas.push_back(kPi * (points[near.back()] - points[i]).squaredNorm() / static_cast<double>(kNear));
  }
  std::nth_element(areas.begin(), areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2), areas.end());
  return std::sqrt(areas[areas.size() / 2]);
}

}  // namespace

ThinPoints thin_points(std::span<const Vec3f> points, std::size_t most) {
  std::vector<Key> keys(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f p = points[i] + Vec3f::Zero();  // -0 becomes 0
    std::memcpy(keys[i].data(), p.data(), sizeof(Key));
  }
  ThinPoints out = join_equal(points, keys);
  if (out.position.size() <= most) return out;
  // A surface passes through 1.5 cubes (1 along the axes, 2 where it is aslant) per square of their side.
  const double side = typical_spacing(out.position) *
                      std::sqrt(1.5 * static_cast<double>(out.position.size()) / static_cast<double>(most));
  Vec3f low = points[0];
  for (const Vec3f& p : points) low = low.cwiseMin(p);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      keys[i][static_cast<std::size_t>(axis)] =
          static_cast<std::int32_t>(std::min(2e9, static_cast<double>(points[i][axis] - low[axis]) / side));
  return join_equal(points, keys);
}

}  // namespace tribin::surfel_detail
