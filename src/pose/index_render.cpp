#include "tribin/pose/index_render.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/cad/half_edges.hpp"

namespace tribin {
namespace {

struct ScreenVertex {
  float x, y;        ///< window coordinates
  float cx, cy, cz;  ///< camera frame
};

/// Every edge once, without those between coplanar triangles, which are never an outline.
std::vector<OutlineEdge> outline_edges(const RenderMesh& mesh) {
  std::vector<OutlineEdge> out;
  for_each_edge(sorted_half_edges(mesh.triangles), [&](std::span<const HalfEdge> edge) {
    if (edge.size() > 2) return;  // where shells touch
    const std::uint32_t left = edge[0].triangle, right = edge.back().triangle;
    if (edge.size() == 2 && mesh.normals[left].dot(mesh.normals[right]) > 0.999999f) return;
    out.push_back({{edge[0].low, edge[0].high},
                   {static_cast<std::int32_t>(left), edge.size() == 2 ? static_cast<std::int32_t>(right) : -1}});
  });
  return out;
}

}  // namespace

RenderMesh make_render_mesh(const Mesh& mesh) {
  RenderMesh out;
  out.vertices = mesh.vertices;
  out.triangles = mesh.triangles;
  out.two_sided = !mesh.oriented;
  out.normals.reserve(mesh.triangles.size());
  out.offsets.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
    const Eigen::Vector3d n = (mesh.vertices[t[1]].cast<double>() - a).cross(mesh.vertices[t[2]].cast<double>() - a);
    const double length = n.norm();
    out.normals.push_back(length > 0 ? Vec3f((n / length).cast<float>()) : Vec3f(0, 0, 0));
    out.offsets.push_back(static_cast<float>(out.normals.back().cast<double>().dot(a)));
  }
  out.edges = outline_edges(out);
  if (!mesh.vertices.empty()) {
    out.box_min = out.box_max = mesh.vertices[0].cast<double>();
    for (const Vec3f& v : mesh.vertices) {
      out.box_min = out.box_min.cwiseMin(v.cast<double>());
      out.box_max = out.box_max.cwiseMax(v.cast<double>());
    }
  }
  return out;
}

void render_index(const RenderMesh& mesh, const PinholeCamera& camera, const Pose& camera_from_part, int step,
                  IndexRender& render) {
  thread_local std::vector<ScreenVertex> screen;
  screen.resize(mesh.vertices.size());
  render.step = step;
  render.silhouette_pixels = 0;
  render.width = render.height = 0;
  render.triangle.clear();
  render.inverse_z.clear();

  const Matrix3 rd = camera_from_part.linear();
  const Eigen::Matrix3f r = rd.cast<float>();
  const Eigen::Vector3f t = camera_from_part.translation().cast<float>();
  const float fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const float cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);

  // Full-resolution pixel coordinates first; the window is known only after all vertices are.
  float min_x = 1e30f, max_x = -1e30f, min_y = 1e30f, max_y = -1e30f;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3f& v = mesh.vertices[i];
    ScreenVertex& s = screen[i];
    s.cx = r(0, 0) * v[0] + r(0, 1) * v[1] + r(0, 2) * v[2] + t[0];
    s.cy = r(1, 0) * v[0] + r(1, 1) * v[1] + r(1, 2) * v[2] + t[1];
    s.cz = r(2, 0) * v[0] + r(2, 1) * v[1] + r(2, 2) * v[2] + t[2];
    if (s.cz <= 1.f) return;  // a part at or behind the camera's centre cannot be seen as a part
    const float w = 1.f / s.cz;
    s.x = fx * s.cx * w + cx;
    s.y = fy * s.cy * w + cy;
    min_x = std::min(min_x, s.x);
    max_x = std::max(max_x, s.x);
    min_y = std::min(min_y, s.y);
    max_y = std::max(max_y, s.y);
  }
  if (!(max_x >= 0 && max_y >= 0 && min_x <= camera.width - 1 && min_y <= camera.height - 1)) return;

  // The window starts on a multiple of the step, so that a pose that moves a little samples the same pixels.
  const auto first = [step](float lo) { return static_cast<int>(std::ceil(std::max(lo, 0.f) / step)) * step; };
  const auto last = [step](float hi, int size) {
    return static_cast<int>(std::floor(std::min(hi, static_cast<float>(size - 1)) / step)) * step;
  };
  render.u0 = first(min_x);
  render.v0 = first(min_y);
  render.width = std::max(0, (last(max_x, camera.width) - render.u0) / step + 1);
  render.height = std::max(0, (last(max_y, camera.height) - render.v0) / step + 1);
  if (render.width <= 0 || render.height <= 0) {
    render.width = render.height = 0;
    return;
  }
  const std::size_t pixels = static_cast<std::size_t>(render.width) * render.height;
  render.triangle.assign(pixels, -1);
  render.inverse_z.assign(pixels, 0.f);
  render.normal.resize(mesh.triangles.size());

  const float inverse_step = 1.f / step;
  for (ScreenVertex& s : screen) {
    s.x = (s.x - render.u0) * inverse_step;
    s.y = (s.y - render.v0) * inverse_step;
  }
  const float ray_x0 = (render.u0 - cx) / fx, ray_dx = step / fx;
  const float ray_y0 = (render.v0 - cy) / fy, ray_dy = step / fy;

  const Vec3f eye = (-(rd.transpose() * camera_from_part.translation())).cast<float>();
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    if (!mesh.two_sided && !mesh.faces(k, eye)) continue;
    const auto& tri = mesh.triangles[k];
    const Vec3f& m = mesh.normals[k];
    const float nx = r(0, 0) * m[0] + r(0, 1) * m[1] + r(0, 2) * m[2];
    const float ny = r(1, 0) * m[0] + r(1, 1) * m[1] + r(1, 2) * m[2];
    const float nz = r(2, 0) * m[0] + r(2, 1) * m[1] + r(2, 2) * m[2];
    const ScreenVertex &a = screen[tri[0]], &b = screen[tri[1]], &c = screen[tri[2]];
    const float rho = nx * a.cx + ny * a.cy + nz * a.cz;  // n . q: negative when the facet looks at the camera
    if (rho > 0 && !mesh.two_sided) continue;
    const float lo_x = std::min({a.x, b.x, c.x}), hi_x = std::max({a.x, b.x, c.x});
    const float lo_y = std::min({a.y, b.y, c.y}), hi_y = std::max({a.y, b.y, c.y});
    const int i0 = std::max(0, static_cast<int>(std::ceil(lo_x)));
    const int i1 = std::min(render.width - 1, static_cast<int>(std::floor(hi_x)));
    const int j0 = std::max(0, static_cast<int>(std::ceil(lo_y)));
    const int j1 = std::min(render.height - 1, static_cast<int>(std::floor(hi_y)));
    if (i0 > i1 || j0 > j1 || rho == 0) continue;
    const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area == 0) continue;
    const float sign = area > 0 ? 1.f : -1.f;
    // Edge functions e(x, y) = ex * x + ey * y + e0 >= 0 inside.
    const float e0x = -(b.y - a.y) * sign, e0y = (b.x - a.x) * sign, e00 = -(e0x * a.x + e0y * a.y);
    const float e1x = -(c.y - b.y) * sign, e1y = (c.x - b.x) * sign, e10 = -(e1x * b.x + e1y * b.y);
    const float e2x = -(a.y - c.y) * sign, e2y = (a.x - c.x) * sign, e20 = -(e2x * c.x + e2y * c.y);
    // 1/z is affine on the screen: w = (n . ray) / rho, taken from vertex a so that small triangles lose no digits.
    const float inverse_rho = 1.f / rho;
    const float wx = nx * ray_dx * inverse_rho, wy = ny * ray_dy * inverse_rho;
    const float w0 = (nx * ray_x0 + ny * ray_y0 + nz) * inverse_rho;
    // A facet seen edge-on has rho near 0: its depth stays between those of its vertices all the same.
    const float w_min = 1.f / std::max({a.cz, b.cz, c.cz}), w_max = 1.f / std::min({a.cz, b.cz, c.cz});
    const bool flip = rho > 0;
    bool drawn = false;
    for (int j = j0; j <= j1; ++j) {
      const float y = static_cast<float>(j);
      const float f0 = e0y * y + e00, f1 = e1y * y + e10, f2 = e2y * y + e20, g = wy * y + w0;
      std::int32_t* index_row = render.triangle.data() + render.index(0, j);
      float* w_row = render.inverse_z.data() + render.index(0, j);
      for (int i = i0; i <= i1; ++i) {
        const float x = static_cast<float>(i);
        if (e0x * x + f0 < 0 || e1x * x + f1 < 0 || e2x * x + f2 < 0) continue;
        const float w = std::clamp(wx * x + g, w_min, w_max);
        if (w > w_row[i]) {
          w_row[i] = w;
          index_row[i] = static_cast<std::int32_t>(k);
          drawn = true;
        }
      }
    }
    if (drawn) render.normal[k] = flip ? Vec3f(-nx, -ny, -nz) : Vec3f(nx, ny, nz);
  }
  for (std::int32_t k : render.triangle) render.silhouette_pixels += k >= 0;
}

}  // namespace tribin
