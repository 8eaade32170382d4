#include "capture/circle_bias.hpp"

#include <Eigen/LU>
#include <cmath>

#include "capture/calibration_steps.hpp"

namespace tribin::calibration_detail {
namespace {

/// Picture area of a small piece of the board, by its own [px^2 / mm^2].
double area_scale(const Device& device, const Pose& device_from_board, const Vec3& place) {
  constexpr double kStep = 0.01;  // mm: a hundredth of a pixel or so
  const auto at = [&](double x, double y) {
    return project(device.intrinsics, device_from_board * Vec3(place + Vec3(x, y, 0)));
  };
  const Vec2 dx = (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep), dy = (at(0, kStep) - at(0, -kStep)) / (2 * kStep);
  return std::abs(dx.x() * dy.y() - dx.y() * dy.x());
}

}  // namespace

Vec2 circle_bias(const Device& device, const Pose& device_from_board, const Vec3& centre, double radius_mm) {
  constexpr int kRings = 4, kSpokes = 12;
  Vec2 sum = Vec2::Zero();
  double weight = 0;
  for (int ring = 0; ring < kRings; ++ring)
    for (int spoke = 0; spoke < kSpokes; ++spoke) {
      // The middle of equal areas of the disc.
      const double r = radius_mm * std::sqrt((ring + 0.5) / kRings),
                   angle = 2 * kPi * (spoke + 0.5 * (ring % 2)) / kSpokes;
      const Vec3 place = centre + Vec3(r * std::cos(angle), r * std::sin(angle), 0);
      const double w = area_scale(device, device_from_board, place);
      sum += w * project(device.intrinsics, device_from_board * place);
      weight += w;
    }
  return sum / weight - project(device.intrinsics, device_from_board * centre);
}

bool centre_circles(const Board& board, const Bundle& bundle, std::span<const BoardObserver> observers,
                    std::vector<BoardObserver>& centred) {
  const std::vector<Vec3> points = board_points(board);
  // Sights are those of the observers, but boards that look alike may be turned: the sight tells the place.
  std::vector<double> radii;
  const auto each = [&](auto&& visit) {
    for (const Sight& s : bundle.sights) {
      const auto d = static_cast<std::size_t>(s.device), v = static_cast<std::size_t>(s.view);
      const BoardSighting& seen = observers[d].views[v];
      if (seen.area_px.size() != seen.pixel.size() || s.pixel.size() != seen.pixel.size()) continue;
      const Pose device_from_board = bundle.devices[d].rig_from_device.inverse() * bundle.rig_from_board[v];
      for (std::size_t i = 0; i < s.pixel.size(); ++i) visit(d, v, i, s.point[i], device_from_board);
    }
  };
  each([&](std::size_t d, std::size_t v, std::size_t i, const Vec3& place, const Pose& pose) {
    if (!bundle.view_used[v]) return;
    const double scale = area_scale(bundle.devices[d], pose, place);
    if (scale > 0) radii.push_back(std::sqrt(observers[d].views[v].area_px[i] / (kPi * scale)));
  });
  if (radii.empty()) return false;
  const double radius = median(radii);
  each([&](std::size_t d, std::size_t v, std::size_t i, const Vec3& place, const Pose& pose) {
    const Vec2 bias = circle_bias(bundle.devices[d], pose, place, radius);
    if (bias.allFinite()) centred[d].views[v].pixel[i] = observers[d].views[v].pixel[i] - bias;
  });
  return true;
}

}  // namespace tribin::calibration_detail
