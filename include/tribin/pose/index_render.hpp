#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/camera.hpp"

namespace tribin {

/// An edge of the mesh and the two triangles beside it (-1 = a border).
struct OutlineEdge {
  std::array<std::uint32_t, 2> vertices;
  std::array<std::int32_t, 2> triangles;
};

/// A mesh laid out for rendering: facet planes beside the triangles, float coordinates.
struct RenderMesh {
  std::vector<Vec3f> vertices;  ///< part frame, mm
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec3f> normals;      ///< unit, outward, one a triangle
  std::vector<float> offsets;      ///< normal . vertex [mm], one a triangle
  std::vector<OutlineEdge> edges;  ///< those that can be an outline: not between coplanar triangles
  bool two_sided = false;          ///< the mesh has no known orientation
  Vec3 box_min = Vec3::Zero();
  Vec3 box_max = Vec3::Zero();

  /// Does a triangle look at a camera at `eye` (part frame)?
  bool faces(std::size_t triangle, const Vec3f& eye) const {
    const Vec3f& n = normals[triangle];
    return n[0] * eye[0] + n[1] * eye[1] + n[2] * eye[2] > offsets[triangle];
  }
};

RenderMesh make_render_mesh(const Mesh& mesh);

/// Which triangle each pixel of a window sees, and how far away. Pixel (i, j) of the window is pixel
/// (u0 + i * step, v0 + j * step) of the camera.
struct IndexRender {
  int u0 = 0, v0 = 0;
  int width = 0, height = 0;
  int step = 1;
  std::vector<std::int32_t> triangle;  ///< -1 = the part is not seen
  std::vector<float> inverse_z;        ///< [1/mm], 0 where not seen
  std::vector<Vec3f> normal;           ///< facet normals in the camera frame, one a TRIANGLE; valid for seen triangles
  std::size_t silhouette_pixels = 0;   ///< seen pixels

  std::size_t index(int i, int j) const { return static_cast<std::size_t>(j) * width + i; }
};

/// Renders the part at a pose with a z-buffer; every `step`-th pixel each way.
/// \param render  filled; its buffers are reused between calls.
/// \cost          about 1 ns a vertex, 1 ns a triangle, 15 ns one that faces the camera and holds a pixel, 3 ns a row
/// of it.
void render_index(const RenderMesh& mesh, const PinholeCamera& camera, const Pose& camera_from_part, int step,
                  IndexRender& render);

}  // namespace tribin
