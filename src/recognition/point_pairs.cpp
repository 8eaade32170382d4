#include "point_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

constexpr int kAngles = 15;     // steps of 12 deg
constexpr int kLengths = 21;    // steps of 5 % up to the diameter
constexpr int kCosines = 1024;  // finer than 0.2 deg but beside 0 and 180 deg, where a step of 12 deg is far away

/// Step of the angle whose cosine is c.
std::uint32_t angle_step(float c) {
  static const std::array<std::uint8_t, kCosines + 1> table = [] {
    std::array<std::uint8_t, kCosines + 1> out{};
    for (int i = 0; i <= kCosines; ++i) {
      const double angle = std::acos(std::clamp(2.0 * i / kCosines - 1, -1.0, 1.0));
      out[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::min(kAngles - 1.0, angle / kPi * kAngles));
    }
    return out;
  }();
  return table[static_cast<std::size_t>(std::clamp((c + 1) * (0.5f * kCosines) + 0.5f, 0.f, float(kCosines)))];
}

}  // namespace

PointPairSteps::PointPairSteps(double diameter_mm) : inverse_step_(static_cast<float>(1 / (0.05 * diameter_mm))) {}

std::uint32_t PointPairSteps::keys() const { return kLengths * kAngles * kAngles * kAngles; }

std::optional<PointPair> PointPairSteps::pair(const Vec3f& p, const Vec3f& n, const Vec3f& u, const Vec3f& v,
                                              const Vec3f& q, const Vec3f& m) const {
  const Vec3f d = q - p;
  const float length = d.norm();
  const float step = length * inverse_step_;
  if (!(step > 0.5f) || step >= kLengths) return std::nullopt;
  const float inverse = 1 / length;
  PointPair out;
  out.key = ((static_cast<std::uint32_t>(step) * kAngles + angle_step(n.dot(d) * inverse)) * kAngles +
             angle_step(m.dot(d) * inverse)) *
                kAngles +
            angle_step(n.dot(m));
  out.turn = std::atan2(d.dot(v), d.dot(u));
  return out;
}

PointPairTable::PointPairTable(std::span<const Vec3f> points, std::span<const Vec3f> normals, double diameter_mm)
    : steps_(diameter_mm) {
  const int n = static_cast<int>(points.size());
  struct Made {
    std::uint32_t key;
    Entry entry;
  };
  std::vector<std::vector<Made>> rows(points.size());
  parallel_ranges(n, 16, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const auto a = static_cast<std::size_t>(i);
      Vec3 ud, vd;
      orthonormal_basis(normals[a].cast<double>(), ud, vd);
      const Vec3f u = ud.cast<float>(), v = vd.cast<float>();
      rows[a].reserve(points.size());
      for (std::size_t b = 0; b < points.size(); ++b) {
        const auto pair = b == a ? std::nullopt : steps_.pair(points[a], normals[a], u, v, points[b], normals[b]);
        if (!pair) continue;
        const int turn = static_cast<int>(std::floor(pair->turn / (2 * kPi) * kTurns)) & (kTurns - 1);
        rows[a].push_back({pair->key, {static_cast<std::uint16_t>(a), static_cast<std::uint8_t>(turn)}});
      }
    }
  });
  first_.assign(steps_.keys() + 2, 0);
  for (const auto& row : rows)
    for (const Made& made : row) ++first_[made.key + 2];
  for (std::size_t k = 2; k < first_.size(); ++k) first_[k] += first_[k - 1];
  entries_.resize(first_.back());
  for (const auto& row : rows)
    for (const Made& made : row) entries_[first_[made.key + 1]++] = made.entry;
}

}  // namespace tribin
