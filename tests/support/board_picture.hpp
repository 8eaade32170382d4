#pragma once

#include <algorithm>
#include <cmath>

#include "sim/random.hpp"
#include "tribin/capture/board.hpp"
#include "tribin/capture/rig.hpp"
#include "tribin/core/image.hpp"

namespace tribin::test {

/// How a picture of a board is taken.
struct PictureOptions {
  double blur_px = 0.8;  ///< sd of the lens' blur
  double noise = 2;      ///< sd of a grey level
  double dark = 40, light = 200;
  Image<std::uint8_t> markers{};  ///< charuco: the printed board, `marker_scale` px a mm, upper left corner first
  double marker_scale = 0;
};

/// Signed distance from the nearest dark-light edge of a checker coordinate, in squares; positive in even squares.
inline double checker_side(double x) {
  const double cell = std::floor(x), in = x - cell, nearest = std::min(in, 1 - in);
  return std::fmod(std::abs(cell), 2) < 0.5 ? nearest : -nearest;
}

/// A step blurred by a Gaussian, in [-1, 1].
inline double blurred_step(double distance_px, double sd) { return std::erf(distance_px / (std::sqrt(2.0) * sd)); }

/// Light of a point of the board [0, 1] with a blur of so many pixels, `per_px` [mm] being a pixel's size on the board
/// along x and y.
inline double board_light(const Board& board, const PictureOptions& options, double x, double y, const Vec2& per_px) {
  const double p = board.pitch_mm, sd = options.blur_px;
  if (board.kind == BoardKind::chessboard) {
    // Squares reach one beyond the inner corners, then comes white paper, one square wide; else it is grey.
    if (x < -2 * p || y < -2 * p || x > (board.columns + 1) * p || y > (board.rows + 1) * p) return 0.3;
    if (x < -p || y < -p || x > board.columns * p || y > board.rows * p) return 1;
    const double sx = blurred_step(checker_side(x / p) * p / per_px.x(), sd),
                 sy = blurred_step(checker_side(y / p) * p / per_px.y(), sd);
    return 0.5 - 0.5 * sx * sy;
  }
  if (board.kind == BoardKind::charuco) {
    // The printed picture begins one square before the first inner corner.
    const double u = (x + p) * options.marker_scale - 0.5, v = (y + p) * options.marker_scale - 0.5;
    const int u0 = static_cast<int>(std::floor(u)), v0 = static_cast<int>(std::floor(v));
    const double a = u - u0, b = v - v0;
    const auto at = [&](int i, int j) { return options.markers.contains(i, j) ? options.markers(i, j) / 255.0 : 1.0; };
    return (1 - b) * ((1 - a) * at(u0, v0) + a * at(u0 + 1, v0)) +
           b * ((1 - a) * at(u0, v0 + 1) + a * at(u0 + 1, v0 + 1));
  }
  // Dark circles, a fifth of the rows' distance in radius.
  const double row_step = board.kind == BoardKind::asymmetric_circles ? 0.5 : 1.0;
  const int r = std::clamp(static_cast<int>(std::lround(y / (p * row_step))), 0, board.rows - 1);
  double nearest = 1e9;  // [px] from a circle's edge, outside > 0
  const double radius = 0.2 * p * row_step;
  for (int row = std::max(0, r - 1); row <= std::min(board.rows - 1, r + 1); ++row) {
    const double shift = board.kind == BoardKind::asymmetric_circles ? 0.5 * (row % 2) : 0.0;
    const int c = std::clamp(static_cast<int>(std::lround(x / p - shift)), 0, board.columns - 1);
    const double dx = x - (c + shift) * p, dy = y - row * row_step * p, d = std::hypot(dx, dy);
    const double mm_a_px = d > 0 ? std::hypot(per_px.x() * dx, per_px.y() * dy) / d : per_px.x();
    nearest = std::min(nearest, (d - radius) / mm_a_px);
  }
  if (x < -2 * p || y < -2 * p || x > (board.columns + 1) * p || y > (row_step * board.rows + 1) * p) return 0.3;
  return 0.5 + 0.5 * blurred_step(nearest, sd);
}

/// The picture that a camera takes of a board, with its distortion, blur and noise. ChArUco's blur is that of the
/// print.
inline Image<std::uint8_t> board_picture(const Board& board, const RigCamera& camera, const Pose& rig_from_board,
                                         const PictureOptions& options, unsigned seed) {
  sim::Random random(seed);
  const PinholeCamera& c = camera.camera;
  const Pose board_from_camera = rig_from_board.inverse() * camera.rig_from_camera;
  Image<Vec2> place(c.width + 1, c.height + 1, Vec2::Constant(1e6));
  for (int v = 0; v <= c.height; ++v)
    for (int u = 0; u <= c.width; ++u) {
      const Vec3 ray = c.ray(u, v);
      const std::optional<Vec2> ideal = undistorted(camera.distortion, {ray.x(), ray.y()});
      if (!ideal) continue;
      const Vec3 along = board_from_camera.linear() * Vec3(ideal->x(), ideal->y(), 1),
                 from = board_from_camera.translation();
      const double depth = -from.z() / along.z();
      if (depth > 0) place(u, v) = (from + depth * along).head<2>();
    }
  Image<std::uint8_t> out(c.width, c.height);
  for (int v = 0; v < c.height; ++v)
    for (int u = 0; u < c.width; ++u) {
      const Vec2 p = place(u, v), right = place(u + 1, v) - p, down = place(u, v + 1) - p;
      const Vec2 per_px(std::hypot(right.x(), down.x()), std::hypot(right.y(), down.y()));
      const double light = p.x() > 1e5 ? 0.3 : board_light(board, options, p.x(), p.y(), per_px);
      const double grey = options.dark + (options.light - options.dark) * light + options.noise * random.normal();
      out(u, v) = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
    }
  return out;
}

}  // namespace tribin::test
