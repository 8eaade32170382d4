#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "report/palette.hpp"
#include "tribin/core/camera.hpp"
#include "tribin/core/geometry.hpp"

namespace tribin::report {

/// Triangles to draw: shared vertices with normals (towards the viewer or not: shading turns them), one material each.
struct ShadedSurface {
  std::vector<Vec3f> vertices;
  std::vector<Vec3f> normals;  ///< of the vertices; empty = flat triangles
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Material> materials;  ///< of the triangles
  std::vector<std::uint8_t> steps;  ///< of the triangles, for Material::height; may be empty
  std::vector<float> tints;         ///< of the triangles: added to the shade; may be empty
  std::vector<std::uint16_t> ids;   ///< of the triangles: the primitive that each shows, 0 = none; may be empty
};

/// Parallel projection: x right, y down, z away from the viewer.
struct View {
  Matrix3 view_from_world = Matrix3::Identity();
  Vec3 center = Vec3::Zero();  ///< world point in the middle of the picture
  double px_per_mm = 1;
  int width = 0;
  int height = 0;

  Vec3 project(const Vec3& world) const {
    const Vec3 v = view_from_world * (world - center) * px_per_mm;
    return {v.x() + 0.5 * width, v.y() + 0.5 * height, v.z() / px_per_mm};
  }
};

/// The view along `direction` (unit, world, away from the viewer) with world vector `down` downwards in the picture.
View view_along(const Vec3& direction, const Vec3& down, const Vec3& center, double width_mm, int width, int height);

/// A small software renderer with a depth buffer [mm along the view], onto palette indices (0 = nothing).
struct Canvas {
  View view;
  Image<std::uint8_t> indices;
  Image<float> depth;
  Image<std::uint16_t> ids;  ///< primitive in each pixel, 0 = none

  explicit Canvas(const View& v)
      : view(v), indices(v.width, v.height, 0), depth(v.width, v.height, 1e30f), ids(v.width, v.height, 0) {}
  void draw(const ShadedSurface& surface);
  /// A line in space, `width_px` wide, where it is nearer than the depth buffer + slack_mm; it leaves the buffer alone.
  void line(const Vec3& a, const Vec3& b, Material material, double width_px, double slack_mm);
};

/// Depth of a posed surface in a pinhole camera: Image of z [mm], NaN where it is not.
Image<float> depth_of(const std::vector<Vec3f>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                      const Pose& camera_from_part, const PinholeCamera& camera);

}  // namespace tribin::report
