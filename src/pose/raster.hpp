#pragma once

#include <cstdint>
#include <vector>

#include "tribin/pose/index_render.hpp"

// The passes of an index render, each a loop over arrays that runs on wide vectors, in this order.
namespace tribin::raster {

// Pixels are drawn in blocks that lie at multiples of this many columns: a narrow triangle costs one masked block a
// row, without a branch that cannot be predicted, and blocks written by one triangle are read whole by the next.
constexpr int kBlock = 16;

/// Buffers of one render, structure of arrays.
struct Canvas {
  std::vector<float> x, y;          ///< of the vertices: pixels of the camera, then of the window
  std::vector<float> z;             ///< of the vertices, camera frame [mm]
  std::vector<float> side;          ///< of each triangle: n . eye - offset [mm], positive when it faces the camera
  std::vector<std::int32_t> front;  ///< triangles to draw
  std::vector<std::int32_t> hold;   ///< of each of them: does its box hold a pixel?
  std::vector<float> depth;         ///< of each triangle: 1/z = x depth[0] + y depth[1] + depth[2]
  std::vector<float> corners;       ///< kCorner numbers of each of those to draw, one array a number
  std::vector<float> setup;         ///< kSetup numbers of each of them, one array a number
  int width = 0;                    ///< of the window, up to a multiple of kBlock
  struct alignas(sizeof(float) * kBlock) Depths {
    float lane[kBlock];
  };
  struct alignas(sizeof(std::int32_t) * kBlock) Numbers {
    std::int32_t lane[kBlock];
  };
  std::vector<Depths> inverse_z;
  std::vector<Numbers> triangle;
};

/// A pose and camera in floats: pixel = f * (R p + t) / z + c.
struct Projection {
  float r[9], t[3];
  float fx, fy, cx, cy;
};

void project_vertices(const float* points, std::size_t count, const Projection& m, float* x, float* y, float* z);

struct Range {
  float low, high;
};

Range range_of(const float* values, std::size_t count);

/// Pixels of the camera -> of the window.
void into_window(float* x, std::size_t count, float first, float inverse_step);

void sides_of_camera(const float* normals, const float* offsets, std::size_t count, const Vec3f& eye, float* side);

/// Numbers of the triangles that face the camera; `out` has room for one more than there are triangles.
/// \return how many
std::size_t facing(const std::vector<float>& side, bool two_sided, std::int32_t* out);

/// Corners of triangles on the screen, one array a number, those with the lower vertex number first.
enum Corner { kAx, kAy, kAz, kBx, kBy, kBz, kCx, kCy, kCz, kCorner };

void gather_corners(const RenderMesh& mesh, const std::int32_t* which, std::size_t count, const float* x,
                    const float* y, const float* z, float* out);

/// Which triangles have a box that holds a pixel of the window: most do not where pixels are coarse.
void hold_pixels(const float* corners, std::size_t count, int width, int height, std::int32_t* hold);

/// What is set up of a triangle. Edges: inside where ex x + ey y + e0 >= 0.
// clang-format off
enum Setup {
  kE0x, kE0y, kE00, kE1x, kE1y, kE10, kE2x, kE2y, kE20,  // edges
  kWMin, kWMax,                                          // bounds of 1/z
  kX0, kX1, kY0, kY1,                                    // box
  kArea,                                                 // twice, signed
  kSetup
};
// clang-format on

/// Corners -> edges and boxes.
void set_up(const float* corners, std::size_t count, float* out);

/// n . ray of a facet in the part frame is affine in the pixel of the window: n . (origin + x across + y down).
struct Rays {
  Vec3f origin, across, down;
};

/// n . ray of each facet at the window's first pixel, and its steps; over -(n . q) of the facet's points: 1/z.
void facet_depths(const float* normals, const float* side, std::size_t count, const Rays& rays, float* out);

/// Draws the first `count` triangles of `canvas.front` into the canvas. \param lane  0, 1, ..., kBlock - 1
void draw_triangles(Canvas& canvas, std::size_t count, int width, int height, const float* lane);

/// Normals in the camera frame, towards the camera.
void turn_normals(const float* normals, const float* side, std::size_t count, const float* rotation, float* out);

}  // namespace tribin::raster
