#include "surfel/tangent_mask.hpp"

#include <array>
#include <cmath>
#include <vector>

#include "tribin/core/parallel.hpp"

namespace tribin::surfel_detail {
namespace {

// sd of the smoothing [px]: the paper gives none. Half a pixel takes off single outliers and leaves the window what it
// is; more would widen it, and blur edges.
constexpr double kSmooth = 0.5;
constexpr int kReach = 2;

/// Normalised convolution: holes weigh nothing.
Image<float> smoothed(const Scan& scan) {
  double kernel[kReach + 1];
  for (int k = 0; k <= kReach; ++k) kernel[k] = std::exp(-0.5 * k * k / (kSmooth * kSmooth));
  Image<float> out(scan.width(), scan.height(), std::nanf(""));
  parallel_ranges(scan.height(), 16, [&](int begin, int end) {
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < scan.width(); ++u) {
        if (!std::isfinite(scan.z_mm(u, v))) continue;
        double sum = 0, weight = 0;
        for (int dv = -kReach; dv <= kReach; ++dv)
          for (int du = -kReach; du <= kReach; ++du) {
            if (!scan.z_mm.contains(u + du, v + dv) || !std::isfinite(scan.z_mm(u + du, v + dv))) continue;
            const double w = kernel[std::abs(du)] * kernel[std::abs(dv)];
            sum += w * scan.z_mm(u + du, v + dv);
            weight += w;
          }
        out(u, v) = static_cast<float>(sum / weight);
      }
  });
  return out;
}

/// Points of an N x N mask about its centre; a cell without points is left out with those that it pairs with.
struct Mask {
  int half = 1;
  std::vector<Vec3> sum;
  std::vector<int> count;

  explicit Mask(int n) : half(n / 2), sum(static_cast<std::size_t>(n) * n), count(sum.size()) {}
  void clear() {
    std::fill(sum.begin(), sum.end(), Vec3::Zero());
    std::fill(count.begin(), count.end(), 0);
  }
  std::size_t at(int i, int j) const { return static_cast<std::size_t>((j + half) * (2 * half + 1) + i + half); }
  void add(int i, int j, const Vec3& p) {
    if (std::abs(i) > half || std::abs(j) > half) return;
    sum[at(i, j)] += p;
    ++count[at(i, j)];
  }
  /// Sum of the normals of all triangles that a pair of opposite cells makes with the pair a quarter turn on; their
  /// areas are their weights, so that on a full mask it is the least-squares plane. Zero where no two pairs are full.
  Vec3 normal() const {
    Vec3 total = Vec3::Zero();
    for (int j = 0; j <= half; ++j)
      for (int i = 1; i <= half; ++i) {  // a quarter of the mask, the three others by turning
        const std::size_t a = at(i, j), b = at(-i, -j), c = at(-j, i), d = at(j, -i);
        if (count[a] == 0 || count[b] == 0 || count[c] == 0 || count[d] == 0) continue;
        total += (sum[a] / count[a] - sum[b] / count[b]).cross(sum[c] / count[c] - sum[d] / count[d]);
      }
    return total;
  }
};

}  // namespace

Image<Vec3f> tangent_mask_normals(const Scan& scan, int window_px) {
  const Image<float> z = smoothed(scan);
  const auto point = [&](int u, int v) {
    return scan.rays.empty() ? scan.camera.point(u, v, z(u, v)) : Vec3(scan.rays(u, v).cast<double>() * z(u, v));
  };
  Image<Vec3f> normals(scan.width(), scan.height(), Vec3f::Zero());
  const int half = window_px / 2;
  parallel_ranges(scan.height(), 8, [&](int begin, int end) {
    Mask mask(window_px);
    for (int v = begin; v < end; ++v)
      for (int u = 0; u < scan.width(); ++u) {
        if (!std::isfinite(z(u, v))) continue;
        const Vec3 center = point(u, v);
        mask.clear();
        const auto each = [&](int reach, auto&& visit) {
          for (int dv = -reach; dv <= reach; ++dv)
            for (int du = -reach; du <= reach; ++du)
              if (z.contains(u + du, v + dv) && std::isfinite(z(u + du, v + dv)))
                visit(du, dv, Vec3(point(u + du, v + dv) - center));
        };
        each(half, [&](int du, int dv, const Vec3& q) { mask.add(du, dv, q); });
        Vec3 first = mask.normal();
        if (first.squaredNorm() == 0) continue;
        first.normalize();
        if (first.dot(center) > 0) first = -first;
        // Equation (1): the turn about k = n x e_z that takes the normal to the axis.
        const Matrix3 turn = Eigen::Quaterniond::FromTwoVectors(first, -Vec3::UnitZ()).toRotationMatrix();
        // Cells as wide as the pixels are apart on the surface, in the direction that it falls off.
        const double facing = std::max(0.2, -first.dot(center.normalized()));
        const double cell = center.z() / std::min(scan.camera.fx, scan.camera.fy);
        mask.clear();
        const Vec3 across(first.x(), first.y(), 0);
        const double length = across.norm();
        // In the tangent plane the fall line is stretched by 1 / facing; the mask is stretched with it.
        const Vec3 fall = length > 1e-6 ? Vec3(turn * (across / length)) : Vec3(Vec3::UnitX());
        const Vec3 fall2 = Vec3(fall.x(), fall.y(), 0).normalized();
        each(half, [&](int, int, const Vec3& q) {
          Vec3 p = turn * q;
          Vec3 flat(p.x(), p.y(), 0);
          flat -= fall2 * (fall2.dot(flat) * (1 - facing));
          mask.add(static_cast<int>(std::lround(flat.x() / cell)), static_cast<int>(std::lround(flat.y() / cell)), p);
        });
        Vec3 second = mask.normal();
        if (second.squaredNorm() == 0) second = turn * first;
        second = turn.transpose() * second.normalized();
        if (second.dot(center) > 0) second = -second;
        normals(u, v) = second.cast<float>();
      }
  });
  return normals;
}

}  // namespace tribin::surfel_detail
