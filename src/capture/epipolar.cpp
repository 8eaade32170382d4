#include "capture/epipolar.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace tribin::capture_detail {
namespace {

constexpr int kSquare = 64;

/// Linear interpolation along a row.
double along(const Image<float>& image, double u, int v) {
  const int u0 = static_cast<int>(u);
  const double a = u - u0;
  return (1 - a) * image(u0, v) + a * image(u0 + 1, v);
}

/// dy of one square by brightness; NaN where its texture does not tell it to a fifth of a pixel.
double by_brightness(const ViewImage& first, const ViewImage& second, const Image<float>& match, int u0, int v0) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double square = 0;
  int count = 0;
  for (int v = std::max(1, v0); v < std::min(v0 + kSquare, second.brightness.height - 1); ++v)
    for (int u = u0; u < std::min(u0 + kSquare, match.width); ++u) {
      const double m = match(u, v);
      if (!std::isfinite(m) || m < 0 || m >= second.brightness.width - 1) continue;
      const double here = first.brightness(u, v), there = along(second.brightness, m, v);
      const double slope = 0.5 * (along(second.brightness, m, v + 1) - along(second.brightness, m, v - 1));
      if (!std::isfinite(here + there + slope)) continue;
      const Eigen::Vector3d a(1, there, slope);
      normal += a * a.transpose();
      right += a * here;
      square += here * here;
      ++count;
    }
  const double none = std::nan("");
  if (count < kSquare * kSquare / 4) return none;
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  const Eigen::Vector3d fit = solver.solve(right);
  const Eigen::Matrix3d inverse = solver.solve(Eigen::Matrix3d::Identity());
  const double variance = std::max(0.0, square - fit.dot(right)) / count;
  if (!(fit[1] > 0.2) || !(std::sqrt(variance * inverse(2, 2)) / fit[1] < 0.2)) return none;
  return fit[2] / fit[1];
}

double by_rows(const ViewImage& first, const ViewImage& second, const Image<float>& match, int u0, int v0) {
  std::vector<double> off;
  for (int v = std::max(1, v0); v < std::min(v0 + kSquare, second.row.height - 1); ++v)
    for (int u = u0; u < std::min(u0 + kSquare, match.width); ++u) {
      const double m = match(u, v);
      if (!std::isfinite(m) || m < 0 || m >= second.row.width - 1) continue;
      // Projector rows per camera row turn the difference into camera pixels.
      const double slope = 0.5 * (along(second.row, m, v + 1) - along(second.row, m, v - 1));
      const double value = (first.row(u, v) - along(second.row, m, v)) / slope;
      if (std::isfinite(value)) off.push_back(value);
    }
  if (off.size() < kSquare * kSquare / 16) return std::nan("");
  std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
  return off[off.size() / 2];
}

}  // namespace

EpipolarCheck summary_of(std::vector<double> values) {
  EpipolarCheck out;
  out.places = static_cast<int>(values.size());
  if (values.empty()) return out;
  std::sort(values.begin(), values.end());
  out.median_px = values[values.size() / 2];
  out.spread_px = 0.5 * (values[values.size() * 3 / 4] - values[values.size() / 4]);
  return out;
}

EpipolarCheck check_epipolar(const ViewImage& first, const ViewImage& second, const Image<float>& match) {
  const bool rows = !first.row.empty() && !second.row.empty();
  std::vector<double> off;
  for (int v = 0; v < match.height; v += kSquare)
    for (int u = 0; u < match.width; u += kSquare) {
      const double dy = rows ? by_rows(first, second, match, u, v) : by_brightness(first, second, match, u, v);
      if (std::isfinite(dy)) off.push_back(dy);
    }
  return summary_of(std::move(off));
}

void warn_of_calibration(const EpipolarCheck& check, Scan& scan) {
  // A fitted calibration leaves some tenths, and texture tells a place to a fifth; beyond that edges come out wrong.
  if (check.places < 5 || (std::abs(check.median_px) < 0.5 && check.spread_px < 1)) return;
  char text[160];
  std::snprintf(
      text, sizeof text,
      "the calibration does not fit these frames: epipolar lines are off by %.2f px (half of the image: +- %.2f); "
      "calibrate again",
      check.median_px, check.spread_px);
  scan.warnings.emplace_back(text);
}

}  // namespace tribin::capture_detail
