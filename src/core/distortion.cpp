#include "tribin/core/distortion.hpp"

#include <cmath>

namespace tribin {

Vec2 distorted(const Distortion& d, const Vec2& ideal) {
  const double x = ideal.x(), y = ideal.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

std::optional<Vec2> undistorted(const Distortion& d, const Vec2& seen) {
  double x = seen.x(), y = seen.y(), residual = 1;
  // Fixed point of Brown's model; 20 rounds reach 1e-9 for lenses that a depth camera can have.
  for (int round = 0; round < 50 && residual > 1e-9; ++round) {
    const double r2 = x * x + y * y, radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    const double next_x = (seen.x() - 2 * d[2] * x * y - d[3] * (r2 + 2 * x * x)) / radial;
    const double next_y = (seen.y() - d[2] * (r2 + 2 * y * y) - 2 * d[3] * x * y) / radial;
    residual = std::abs(next_x - x) + std::abs(next_y - y);
    x = next_x;
    y = next_y;
  }
  if (!(residual < 1e-6)) return std::nullopt;
  return Vec2(x, y);
}

}  // namespace tribin
