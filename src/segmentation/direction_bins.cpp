#include "segmentation/direction_bins.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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

constexpr double kNear =
    5.0 * kDegree;  // of neighbours: more than the diagonal of four bins, so that all that touch are in

/// Bins within kNear, in order. Two bins' azimuths differ by what their numbers' difference says, so of the band of z
/// that can be near only those few are looked at whose number says that they are near in azimuth as well.
void list_neighbours(DirectionBins& out) {
  const int bins = static_cast<int>(out.center.size());
  const float cos_near = static_cast<float>(std::cos(kNear));
  const double chord = 2.0 * std::sin(0.5 * kNear);
  const int band = static_cast<int>(std::ceil(chord * bins));
  const double turn = kPi * (3.0 - std::sqrt(5.0));
  std::vector<std::pair<double, int>> by_azimuth;  // |sin| of half the difference in azimuth, difference in number
  for (int d = -band; d <= band; ++d) by_azimuth.emplace_back(std::abs(std::sin(0.5 * d * turn)), d);
  std::sort(by_azimuth.begin(), by_azimuth.end());
  out.near_begin.push_back(0);
  for (int i = 0; i < bins; ++i) {
    const double z = out.center[i].z();
    // chord^2 >= 4 r_i r_j sin^2(half the difference in azimuth), with r_j at least that of the band's upper end. At
    // the pole every azimuth is near, and at the equator the antipodes of the band's other side are.
    const double upper = z + 1.01 * chord;
    double limit = 1;
    if (z > 1.01 * chord && upper < 1) limit = 1.01 * chord / (2.0 * std::pow((1 - z * z) * (1 - upper * upper), 0.25));
    for (const auto& [half, d] : by_azimuth) {
      if (half > limit) break;
      const int j = i + d;
      if (j < 0 || j >= bins) continue;
      if (std::abs(out.center[i].dot(out.center[j])) > cos_near) out.near.push_back(static_cast<std::uint32_t>(j));
    }
    std::sort(out.near.begin() + out.near_begin.back(), out.near.end());
    out.near_begin.push_back(static_cast<std::uint32_t>(out.near.size()));
  }
}

/// From a bin downhill to the nearest: among bins that hold all that touch them, no step nearer means nearest.
int walk(const DirectionBins& bins, int from, const Vec3f& direction) {
  float best_dot = std::abs(bins.center[from].dot(direction));
  for (int at = -1; at != from;) {
    at = from;
    for (std::uint32_t k : bins.neighbours(at)) {
      const float dot = std::abs(bins.center[k].dot(direction));
      if (dot > best_dot) best_dot = dot, from = static_cast<int>(k);
    }
  }
  return from;
}

DirectionBins make(int bins) {
  DirectionBins out;
  out.center = golden_spiral(bins);
  list_neighbours(out);
  out.table.resize(kTable * kTable);
  int row_start = 0;
  for (int j = 0; j < kTable; ++j) {
    row_start = walk(out, row_start, direction_of_table(0, j));
    int bin = row_start;
    for (int i = 0; i < kTable; ++i) {
      bin = walk(out, bin, direction_of_table(i, j));
      out.table[j * kTable + i] = static_cast<std::uint16_t>(bin);
    }
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
