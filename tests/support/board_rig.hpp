#pragma once

#include <string>
#include <vector>

#include "sim/random.hpp"
#include "tribin/capture/calibrate_rig.hpp"
#include "tribin/core/image.hpp"

namespace tribin::test {

/// A rig of which all is known, and the places at which a board was shown to it.
struct BoardRig {
  Board board;
  std::vector<RigCamera> devices;  ///< cameras; the last one a projector where `projector`
  bool projector = false;
  std::vector<Pose> rig_from_board;
  std::vector<std::string> ids;
};

struct BoardRigOptions {
  Board board{BoardKind::chessboard, 9, 6, 20};
  int cameras = 2;
  bool projector = false;
  int views = 14;
  double focal = 1.4;  ///< in picture widths, about
  double tilt = 35 * kDegree;
  int width = 1280, height = 960;
};

inline Pose pose_at(const Vec3& rotation, const Vec3& translation) {
  Pose out = Pose::Identity();
  out.linear() = rotation_from_vector(rotation);
  out.translation() = translation;
  return out;
}

inline RigCamera random_device(sim::Random& random, const BoardRigOptions& options, bool projector) {
  RigCamera out;
  const double width = options.width, height = options.height;
  // A projector lights more than a camera sees.
  const double focal = options.focal * width * random.uniform(0.9, 1.1) * (projector ? 0.8 : 1.0);
  out.camera = {options.width,
                options.height,
                focal,
                focal * random.uniform(0.998, 1.002),
                width * random.uniform(0.48, 0.52),
                height * (projector ? random.uniform(0.8, 1) : random.uniform(0.48, 0.52))};
  // A tenth of the corner's distance at most, as wide industrial lenses have it.
  const double corner = 0.5 * std::hypot(width, height) / focal, square = corner * corner;
  out.distortion = {random.uniform(-0.08, 0.02) / square, random.uniform(-0.02, 0.02) / (square * square),
                    random.uniform(-0.002, 0.002) / corner, random.uniform(-0.002, 0.002) / corner, 0};
  return out;
}

/// Two cameras stand some 150 mm apart and turned to a common point, a projector between them; the board is held all
/// over the first one's view.
inline BoardRig random_board_rig(unsigned seed, const BoardRigOptions& options = {}) {
  sim::Random random(seed);
  BoardRig out;
  out.board = options.board;
  out.projector = options.projector;
  const std::vector<Vec3> points = board_points(out.board);
  const double size = points.back().norm(), distance = 2.2 * size * options.focal;
  for (int c = 0; c < options.cameras + options.projector; ++c) {
    const bool projector = c == options.cameras;
    out.devices.push_back(random_device(random, options, projector));
    RigCamera& device = out.devices.back();
    device.name = projector ? "projector" : c == 0 ? "left" : c == 1 ? "right" : "camera" + std::to_string(c);
    const double aside = projector ? 0.5 : c;
    // The middle of its image, not its principal point, looks at the boards.
    const double up = std::atan2(0.5 * options.height - device.camera.cy, device.camera.fy);
    if (c > 0)
      device.rig_from_camera = pose_at(Vec3(up + random.uniform(-0.02, 0.02),
                                            -0.3 * aside + random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03)),
                                       Vec3(0.3 * distance * aside, random.uniform(-10, 10), random.uniform(-10, 20)));
  }
  const Vec3 middle = 0.5 * (points.front() + points.back());
  for (int v = 0; v < options.views; ++v) {
    const double z = distance * random.uniform(0.85, 1.2);
    const Vec3 place(0.2 * z / options.focal * random.uniform(-1, 1), 0.15 * z / options.focal * random.uniform(-1, 1),
                     z);
    Pose pose = pose_at(Vec3(0, 0, random.uniform(-0.4, 0.4)), Vec3::Zero());
    pose.linear() = pose.linear() * rotation_from_vector(Vec3(options.tilt * random.uniform(-1, 1),
                                                              options.tilt * random.uniform(-1, 1), 0));
    pose.translation() = place - pose.linear() * middle;
    out.rig_from_board.push_back(pose);
    out.ids.push_back(std::to_string(v + 1));
  }
  return out;
}

/// What every device sees, with noise (sd of a coordinate) on each point: the points inside its picture.
inline std::vector<BoardObserver> observed(const BoardRig& rig, double noise_px, unsigned seed) {
  sim::Random random(seed + 77);
  std::vector<BoardObserver> out;
  const std::vector<Vec3> points = board_points(rig.board);
  for (std::size_t d = 0; d < rig.devices.size(); ++d) {
    const RigCamera& device = rig.devices[d];
    BoardObserver o{
        device.name, device.camera.width, device.camera.height, rig.projector && d + 1 == rig.devices.size(), {}};
    for (const Pose& pose : rig.rig_from_board) {
      BoardSighting seen;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec2 pixel =
            pixel_of(device, pose * points[i]) + Vec2(noise_px * random.normal(), noise_px * random.normal());
        if (pixel.minCoeff() < 0 || pixel.x() > o.width - 1 || pixel.y() > o.height - 1) continue;
        seen.point.push_back(static_cast<int>(i));
        seen.pixel.push_back(pixel);
      }
      if (seen.point.size() < points.size() / 2) seen = {};
      o.views.push_back(std::move(seen));
    }
    out.push_back(std::move(o));
  }
  return out;
}

inline std::array<double, 9> intrinsics_of(const RigCamera& c) {
  return {c.camera.fx,     c.camera.fy,     c.camera.cx,     c.camera.cy,    c.distortion[0],
          c.distortion[1], c.distortion[2], c.distortion[3], c.distortion[4]};
}

}  // namespace tribin::test
