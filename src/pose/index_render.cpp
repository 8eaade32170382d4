#include "tribin/pose/index_render.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "move_render.hpp"
#include "raster.hpp"

namespace tribin {
namespace {

raster::Rays rays_of(const PinholeCamera& camera, const Matrix3& rotation, const IndexRender& render) {
  const Vec3 origin((render.u0 - camera.cx) / camera.fx, (render.v0 - camera.cy) / camera.fy, 1);
  const auto in_part = [&](const Vec3& ray) { return Vec3f((rotation.transpose() * ray).cast<float>()); };
  return {in_part(origin), in_part(Vec3(render.step / camera.fx, 0, 0)), in_part(Vec3(0, render.step / camera.fy, 0))};
}

}  // namespace

void render_index(const RenderMesh& mesh, const PinholeCamera& camera, const Pose& camera_from_part, int step,
                  IndexRender& render) {
  using namespace raster;
  thread_local Canvas canvas;
  const std::size_t vertices = mesh.vertices.size();
  render.step = step;
  render.silhouette_pixels = 0;
  render.width = render.height = 0;
  render.triangle.clear();
  render.inverse_z.clear();
  if (mesh.triangles.empty()) return;

  const Matrix3 rd = camera_from_part.linear();
  Projection m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m.r[3 * i + j] = static_cast<float>(rd(i, j));
    m.t[i] = static_cast<float>(camera_from_part.translation()[i]);
  }
  m.fx = static_cast<float>(camera.fx);
  m.fy = static_cast<float>(camera.fy);
  m.cx = static_cast<float>(camera.cx);
  m.cy = static_cast<float>(camera.cy);

  // Full-resolution pixel coordinates first; the window is known only after all vertices are.
  canvas.x.resize(vertices);
  canvas.y.resize(vertices);
  canvas.z.resize(vertices);
  project_vertices(mesh.vertices[0].data(), vertices, m, canvas.x.data(), canvas.y.data(), canvas.z.data());
  // A part at or behind the camera's centre cannot be seen as a part.
  if (!(range_of(canvas.z.data(), vertices).low > 1.f)) return;
  const Range x = range_of(canvas.x.data(), vertices), y = range_of(canvas.y.data(), vertices);
  if (!(x.high >= 0 && y.high >= 0 && x.low <= camera.width - 1 && y.low <= camera.height - 1)) return;

  // The window starts on a multiple of the step, so that a pose that moves a little samples the same pixels.
  const auto first = [step](float lo) { return static_cast<int>(std::ceil(std::max(lo, 0.f) / step)) * step; };
  const auto last = [step](float hi, int size) {
    return static_cast<int>(std::floor(std::min(hi, static_cast<float>(size - 1)) / step)) * step;
  };
  render.u0 = first(x.low);
  render.v0 = first(y.low);
  render.width = std::max(0, (last(x.high, camera.width) - render.u0) / step + 1);
  render.height = std::max(0, (last(y.high, camera.height) - render.v0) / step + 1);
  if (render.width <= 0 || render.height <= 0) {
    render.width = render.height = 0;
    return;
  }
  const std::size_t pixels = static_cast<std::size_t>(render.width) * render.height;
  render.triangle.resize(pixels);
  render.inverse_z.resize(pixels);
  render.normal.resize(mesh.triangles.size());

  const float inverse_step = 1.f / step;
  into_window(canvas.x.data(), vertices, static_cast<float>(render.u0), inverse_step);
  into_window(canvas.y.data(), vertices, static_cast<float>(render.v0), inverse_step);
  const Vec3f eye = (-(rd.transpose() * camera_from_part.translation())).cast<float>();
  const std::size_t triangles = mesh.triangles.size();
  canvas.side.resize(triangles);
  canvas.front.resize(triangles + 1);
  canvas.hold.resize(triangles);
  const float* normals = mesh.normals.data()->data();
  sides_of_camera(normals, mesh.offsets.data(), triangles, eye, canvas.side.data());
  const std::size_t front = facing(canvas.side, mesh.two_sided, canvas.front.data());
  const auto gather = [&](std::size_t count) {
    canvas.corners.resize(kCorner * count);
    gather_corners(mesh, canvas.front.data(), count, canvas.x.data(), canvas.y.data(), canvas.z.data(),
                   canvas.corners.data());
  };
  gather(front);
  hold_pixels(canvas.corners.data(), front, render.width, render.height, canvas.hold.data());
  std::size_t drawn = 0;
  for (std::size_t f = 0; f < front; ++f) {
    canvas.front[drawn] = canvas.front[f];
    drawn += static_cast<std::size_t>(canvas.hold[f]);
  }
  const Rays rays = rays_of(camera, rd, render);
  canvas.setup.resize(kSetup * drawn);
  gather(drawn);
  set_up(canvas.corners.data(), drawn, canvas.setup.data());
  canvas.depth.resize(3 * triangles);
  facet_depths(normals, canvas.side.data(), triangles, rays, canvas.depth.data());

  canvas.width = (render.width + kBlock - 1) / kBlock * kBlock;
  const std::size_t blocks = static_cast<std::size_t>(canvas.width / kBlock) * render.height;
  canvas.inverse_z.resize(blocks);
  canvas.triangle.resize(blocks);
  float* w_image = canvas.inverse_z.data()->lane;
  std::int32_t* index_image = canvas.triangle.data()->lane;
  std::fill_n(w_image, blocks * kBlock, 0.f);
  std::fill_n(index_image, blocks * kBlock, -1);
  std::array<float, kBlock> lane;
  std::iota(lane.begin(), lane.end(), 0.f);
  draw_triangles(canvas, drawn, render.width, render.height, lane.data());
  for (int j = 0; j < render.height; ++j) {
    const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(j) * canvas.width;
    const auto to = static_cast<std::ptrdiff_t>(render.index(0, j));
    std::copy_n(index_image + from, render.width, render.triangle.begin() + to);
    std::copy_n(w_image + from, render.width, render.inverse_z.begin() + to);
  }
  turn_normals(normals, canvas.side.data(), triangles, m.r, render.normal.data()->data());
  for (const std::int32_t k : render.triangle) render.silhouette_pixels += k >= 0;
}

void move_render(const RenderMesh& mesh, const PinholeCamera& camera, const Pose& camera_from_part,
                 IndexRender& render) {
  thread_local std::vector<float> side, depth;
  const std::size_t triangles = mesh.triangles.size();
  if (triangles == 0) return;
  const Matrix3 rd = camera_from_part.linear();
  float r[9];
  for (int i = 0; i < 9; ++i) r[i] = static_cast<float>(rd(i / 3, i % 3));
  const Vec3f eye = (-(rd.transpose() * camera_from_part.translation())).cast<float>();
  side.resize(triangles);
  depth.resize(3 * triangles);
  const float* normals = mesh.normals.data()->data();
  raster::sides_of_camera(normals, mesh.offsets.data(), triangles, eye, side.data());
  raster::facet_depths(normals, side.data(), triangles, rays_of(camera, rd, render), depth.data());
  raster::turn_normals(normals, side.data(), triangles, r, render.normal.data()->data());
  for (int j = 0; j < render.height; ++j)
    for (int i = 0; i < render.width; ++i) {
      const std::size_t p = render.index(i, j);
      if (render.triangle[p] < 0) continue;
      const float* d = depth.data() + 3 * static_cast<std::ptrdiff_t>(render.triangle[p]);
      const float w = d[0] * static_cast<float>(i) + d[1] * static_cast<float>(j) + d[2];
      // Seen edge-on a facet's plane says nothing of where it is.
      if (std::abs(w - render.inverse_z[p]) < 0.01f * render.inverse_z[p]) render.inverse_z[p] = w;
    }
}

}  // namespace tribin
