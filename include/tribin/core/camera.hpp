#pragma once

#include "tribin/core/geometry.hpp"

namespace tribin {

/// An ideal pinhole without distortion. Frame: x right, y down, z forward; pixel centres at integer coordinates.
struct PinholeCamera {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  double fx = 0;   ///< [px], > 0
  double fy = 0;   ///< [px], > 0
  double cx = 0;   ///< [px]
  double cy = 0;   ///< [px]

  /// The ray through pixel (u, v) with z = 1.
  Vec3 ray(double u, double v) const { return {(u - cx) / fx, (v - cy) / fy, 1.0}; }
  /// The point seen at pixel (u, v) at depth z [mm].
  Vec3 point(double u, double v, double z) const { return ray(u, v) * z; }
  /// The pixel of a point with z > 0.
  Vec2 project(const Vec3& p) const { return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy}; }
};

}  // namespace tribin
