#include "tribin/capture/projector_points.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/calibration_start.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

/// Decoded pixels about a point, relative to it.
struct Patch {
  std::vector<Vec3> camera;  ///< z = 0
  std::vector<Vec2> projector;
  std::vector<double> weight;
};

Patch patch_of(const Decoded& decoded, const Vec2& at, double reach) {
  Patch out;
  // Some thousand pixels say as much as all: neighbours share their errors.
  const int step = std::max(1, static_cast<int>(reach / 20));
  for (int v = std::max(0, static_cast<int>(std::ceil(at.y() - reach)));
       v <= std::min<double>(decoded.height() - 1, at.y() + reach); v += step)
    for (int u = std::max(0, static_cast<int>(std::ceil(at.x() - reach)));
         u <= std::min<double>(decoded.width() - 1, at.x() + reach); u += step) {
      if (!std::isfinite(decoded.column(u, v)) || !std::isfinite(decoded.row(u, v))) continue;
      out.camera.emplace_back(u - at.x(), v - at.y(), 0);
      out.projector.emplace_back(decoded.column(u, v), decoded.row(u, v));
      out.weight.push_back(std::pow(std::max<double>(1, decoded.modulation(u, v)), 2));  // 1 / variance
    }
  return out;
}

/// Whether the point lies amid its pixels: a fifth of their weight at least on each side.
bool surrounded(const Patch& patch) {
  double all = 0, right = 0, below = 0;
  for (std::size_t i = 0; i < patch.camera.size(); ++i) {
    all += patch.weight[i];
    right += patch.camera[i].x() > 0 ? patch.weight[i] : 0;
    below += patch.camera[i].y() > 0 ? patch.weight[i] : 0;
  }
  const auto fair = [&](double part) { return part > 0.2 * all && part < 0.8 * all; };
  return fair(right) && fair(below);
}

std::optional<Vec2> projector_pixel(const Decoded& decoded, const Vec2& at, double reach) {
  constexpr std::size_t kFewest = 40;  // eight numbers are fitted
  Patch patch = patch_of(decoded, at, reach);
  std::optional<Eigen::Matrix3d> h;
  for (int round = 0; round < 3; ++round) {
    if (patch.camera.size() < kFewest || !surrounded(patch)) return std::nullopt;
    h = calibration_detail::homography_of(patch.camera, patch.projector, patch.weight);
    if (!h) return std::nullopt;
    // Pixels on the squares' borders mix two brightnesses, and a wrong code is far off: beyond 3 sd they go.
    std::vector<double> off;
    for (std::size_t i = 0; i < patch.camera.size(); ++i) {
      const Eigen::Vector3d p = *h * Eigen::Vector3d(patch.camera[i].x(), patch.camera[i].y(), 1);
      off.push_back((p.head<2>() / p.z() - patch.projector[i]).norm() * std::sqrt(patch.weight[i]));
    }
    std::vector<double> sorted = off;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double limit = 3 * sorted[sorted.size() / 2] / 1.18;  // the median distance of a Gaussian in the plane
    Patch kept;
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (off[i] > limit) continue;
      kept.camera.push_back(patch.camera[i]);
      kept.projector.push_back(patch.projector[i]);
      kept.weight.push_back(patch.weight[i]);
    }
    patch = std::move(kept);
  }
  const Eigen::Vector3d p = h->col(2);  // the point itself is the patch's origin
  return Vec2(p.head<2>() / p.z());
}

}  // namespace

BoardSighting projector_points(const BoardSighting& seen, const Decoded& decoded) {
  if (decoded.column.empty() || decoded.row.empty())
    throw Error(ErrorCode::bad_input, std::string("frames of a board: saw patterns along ") +
                                          (decoded.column.empty() ? "rows" : "columns") +
                                          " alone, wanted both (tribin patterns --axes both)");
  BoardSighting out;
  for (std::size_t i = 0; i < seen.pixel.size(); ++i) {
    // Up to the middle of the squares around it, or nearly to the neighbour.
    double nearest = 1e9;
    for (std::size_t j = 0; j < seen.pixel.size(); ++j)
      if (j != i) nearest = std::min(nearest, (seen.pixel[j] - seen.pixel[i]).norm());
    const std::optional<Vec2> pixel = projector_pixel(decoded, seen.pixel[i], 0.7 * nearest);
    if (!pixel) continue;
    out.point.push_back(seen.point[i]);
    out.pixel.push_back(*pixel);
  }
  return out;
}

}  // namespace tribin
