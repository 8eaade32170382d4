#include "segmentation/direction_bins.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/segmentation/primitives.hpp"

namespace tribin {

std::vector<Vec3f> golden_spiral(int bins) {
  std::vector<Vec3f> centers(static_cast<std::size_t>(bins));
  const double turn = kPi * (3.0 - std::sqrt(5.0));
  for (int k = 0; k < bins; ++k) {
    const double z = 1.0 - (k + 0.5) / bins, r = std::sqrt(1.0 - z * z);
    centers[k] = Vec3(r * std::cos(k * turn), r * std::sin(k * turn), z).cast<float>();
  }
  return centers;
}

namespace segmentation_detail {
namespace {

constexpr int kTable = 128;  // cells a side; each about 1 deg

/// The half sphere on the square [-1, 1]^2: project onto |x| + |y| + |z| = 1, then turn the diamond by 45 deg.
Vec3f direction_of_table(int i, int j) {
  const double a = (i + 0.5) / kTable * 2 - 1, b = (j + 0.5) / kTable * 2 - 1;
  const double x = 0.5 * (a + b), y = 0.5 * (a - b);
  return Vec3(x, y, 1 - std::abs(x) - std::abs(y)).normalized().cast<float>();
}

DirectionBins make(int bins) {
  DirectionBins out;
  out.center = golden_spiral(bins);
  const float cos_near = static_cast<float>(std::cos(5.0 * kDegree));
  out.near_begin.push_back(0);
  for (int i = 0; i < bins; ++i) {
    for (int j = 0; j < bins; ++j)
      if (std::abs(out.center[i].dot(out.center[j])) > cos_near) out.near.push_back(static_cast<std::uint32_t>(j));
    out.near_begin.push_back(static_cast<std::uint32_t>(out.near.size()));
  }
  out.table.resize(kTable * kTable);
  // Bins lie in order of z: only a band of them can be nearest. Below the equator sits the antipode of another bin.
  const double spacing = std::sqrt(2 * kPi / bins) * 1.5;
  for (int j = 0; j < kTable; ++j)
    for (int i = 0; i < kTable; ++i) {
      const Vec3f d = direction_of_table(i, j);
      const int first = std::clamp(static_cast<int>((1 - d.z() - spacing) * bins), 0, bins - 1);
      const int last = std::clamp(static_cast<int>((1 - d.z() + spacing) * bins), 0, bins - 1);
      int best = first;
      float best_dot = -1;
      for (int k = first; k <= last; ++k) {
        const float dot = std::abs(out.center[k].dot(d));
        if (dot > best_dot) best_dot = dot, best = k;
      }
      out.table[j * kTable + i] = static_cast<std::uint16_t>(best);
    }
  return out;
}

}  // namespace

int DirectionBins::find(const Vec3f& direction) const {
  const Vec3f d = direction.z() < 0 ? Vec3f(-direction) : direction;
  const float scale = 1.0f / (std::abs(d.x()) + std::abs(d.y()) + d.z());
  const float x = d.x() * scale, y = d.y() * scale;
  const int i = std::clamp(static_cast<int>((x + y + 1) * 0.5f * kTable), 0, kTable - 1);
  const int j = std::clamp(static_cast<int>((x - y + 1) * 0.5f * kTable), 0, kTable - 1);
  return table[j * kTable + i];
}

const DirectionBins& ijk_bins() {
  static const DirectionBins bins = make(kIjkBins);
  return bins;
}

const DirectionBins& axis_bins() {
  static const DirectionBins bins = make(kParameterBins);
  return bins;
}

}  // namespace segmentation_detail
}  // namespace tribin
