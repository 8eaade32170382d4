#pragma once

#include <vector>

#include "raster.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin::grasp {

/// What a scan leaves free: on each ray the way up to the first surface. All behind it is unknown, and counts as
/// occupied. A tree of columns over the image: each node's column holds those below it.
class DepthSpace {
 public:
  /// Takes the nearest surface of blocks some millimetres wide; a single stray pixel in one is none. A place in a hole
  /// is as near as the nearest surface as far off as the hole's border and a finger's thickness more. What lies out of
  /// the camera's view is free.
  DepthSpace(const Scan& scan, const Pose& base_from_camera);

  /// The same without a part: where it is what was seen, rays are free down to its far side, and down to the surface
  /// beside it where that lies deeper.
  DepthSpace without(const MeshTree& tree, const Pose& base_from_part) const;

  /// The gap between a body (base's frame) and what is occupied, as far as `enough` [mm].
  double gap_mm(const Convex& base_body, double enough) const;

  /// The surface's points as seen, base's frame: one a block that has a measurement.
  std::vector<Vec3> points() const;

 private:
  DepthSpace() = default;
  struct Level {
    int width = 0, height = 0;
    std::vector<float> z;  ///< nearest [mm]; infinity = nothing known
    float at(int u, int v) const { return z[static_cast<std::size_t>(v) * width + u]; }
  };
  Vec3 project(const Vec3& camera_point) const;  ///< to blocks, and 1 / z
  struct Window {
    int u0, v0, u1, v1;  ///< blocks, ends not included
  };
  void fill(const Window& window);  ///< the first level's holes, from raw_
  float nearest_within(int u, int v, int radius) const;
  void build();  ///< levels above the first
  double column_gap(int level, int u, int v, const Convex& body, double enough) const;

  Pose camera_from_base_ = Pose::Identity();
  double fx_ = 1, fy_ = 1, cx_ = 0, cy_ = 0;  ///< of blocks
  std::vector<float> raw_;                    ///< as measured; infinity = hole
  std::vector<Level> levels_;                 ///< first: blocks
  int width_ = 0, height_ = 0;
};

}  // namespace tribin::grasp
