#include "part_pixels.hpp"

#include <algorithm>
#include <cmath>

#include "instance_report.hpp"

namespace tribin {
namespace {

using Flags = std::vector<std::uint8_t>;

/// Spreads flags by n pixels along rows, then along columns.
void dilate(Flags& flags, int width, int height, int n) {
  const auto along = [&](int count, int lines, auto at) {
    Flags line(static_cast<std::size_t>(count));
    for (int l = 0; l < lines; ++l) {
      int last = -n - 1, next = 0;
      for (int i = 0; i < count; ++i) line[static_cast<std::size_t>(i)] = flags[at(l, i)];
      for (int i = 0; i < count; ++i) {
        if (next < i) next = i;
        while (next < count && !line[static_cast<std::size_t>(next)]) ++next;
        if (line[static_cast<std::size_t>(i)]) last = i;
        if (i - last <= n || (next < count && next - i <= n)) flags[at(l, i)] = 1;
      }
    }
  };
  const auto w = static_cast<std::size_t>(width);
  along(width, height, [&](int l, int i) { return static_cast<std::size_t>(l) * w + static_cast<std::size_t>(i); });
  along(height, width, [&](int l, int i) { return static_cast<std::size_t>(i) * w + static_cast<std::size_t>(l); });
}

/// Does the ray that a mirror at this point sends on meet a surface of the scan? Then what was measured there may be
/// that surface's light.
bool sees_itself(const SceneDepth& scene, const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double length,
                 double margin) {
  const Eigen::Vector3d view = point.normalized(), on = view - 2 * view.dot(normal) * normal;
  constexpr int kSteps = 96;
  for (int s = 3; s <= kSteps; ++s) {
    const Eigen::Vector3d x = point + on * (length * s / kSteps);
    if (!(x.z() > 0)) return false;
    const auto u = static_cast<int>(std::lround(x.x() / x.z() * scene.camera.fx + scene.camera.cx));
    const auto v = static_cast<int>(std::lround(x.y() / x.z() * scene.camera.fy + scene.camera.cy));
    if (!scene.z_mm.contains(u, v)) return false;
    const float z = scene.z_mm(u, v);
    if (z > 0 && z < x.z() - margin) return true;
  }
  return false;
}

/// Flags squares of rendered pixels: their middle one speaks for all.
Flags mirrored_pixels(const Part& part, const SceneDepth& scene, const IndexRender& r) {
  constexpr int kSquare = 4;
  Flags out(r.triangle.size(), 0);
  for (int j0 = 0; j0 < r.height; j0 += kSquare)
    for (int i0 = 0; i0 < r.width; i0 += kSquare) {
      // The first pixel from the middle on that shows the part.
      const int i1 = std::min(r.width, i0 + kSquare), j1 = std::min(r.height, j0 + kSquare);
      std::size_t shown = r.index(std::min(i0 + kSquare / 2, i1 - 1), std::min(j0 + kSquare / 2, j1 - 1));
      for (int j = j0; j < j1 && r.triangle[shown] < 0; ++j)
        for (int i = i0; i < i1 && r.triangle[shown] < 0; ++i) shown = r.index(i, j);
      if (r.triangle[shown] < 0) continue;
      const int u = r.u0 + static_cast<int>(shown % static_cast<std::size_t>(r.width)) * r.step;
      const int v = r.v0 + static_cast<int>(shown / static_cast<std::size_t>(r.width)) * r.step;
      const Eigen::Vector3d x = Eigen::Vector3d(scene.camera.ray(u, v)) / double(r.inverse_z[shown]);
      const Eigen::Vector3d n = r.normal[static_cast<std::size_t>(r.triangle[shown])].cast<double>();
      if (!sees_itself(scene, x, n, 3 * part.diameter_mm, 0.03 * part.diameter_mm)) continue;
      for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i) out[r.index(i, j)] = 1;
    }
  // Curved surfaces and what lies between the cast rays: two squares more.
  dilate(out, r.width, r.height, 2 * kSquare);
  return out;
}

}  // namespace

PartPixels compare_pixels(const Part& part, const SceneDepth& scene, const Instance& instance) {
  constexpr double kPixels = 20000;  // more of them do not make systematic terms smaller
  PartPixels out;
  const Pose& pose = instance.camera_from_part;
  out.step = step_for(part, scene, pose, kPixels);
  render_index(part.render_mesh, scene.camera, pose, out.step, out.render);
  const IndexRender& r = out.render;
  Flags edge(r.triangle.size(), 0), border(r.triangle.size(), 0);
  // A step of depth, or a bend: facets of one curved surface bend less than 20 deg from each other.
  const float least_cosine = static_cast<float>(std::cos(20 * kDegree));
  const float jump = 0.004f * static_cast<float>(r.step);  // of the depth, as in inside_silhouette
  const auto compare = [&](std::size_t a, std::size_t b) {
    const std::int32_t s = r.triangle[a], t = r.triangle[b];
    if (s == t) return;
    bool cut = s < 0 || t < 0;
    if (!cut) {
      const float w = r.inverse_z[a];
      cut = std::abs(r.inverse_z[b] - w) > jump * w ||
            r.normal[static_cast<std::size_t>(s)].dot(r.normal[static_cast<std::size_t>(t)]) < least_cosine;
    }
    if (cut) edge[a] = edge[b] = 1;
    if (out.primitive(part, a) != out.primitive(part, b)) border[a] = border[b] = 1;
  };
  for (int j = 0; j < r.height; ++j)
    for (int i = 0; i < r.width; ++i) {
      if (i + 1 < r.width) compare(r.index(i, j), r.index(i + 1, j));
      if (j + 1 < r.height) compare(r.index(i, j), r.index(i, j + 1));
      if ((i == 0 || j == 0 || i + 1 == r.width || j + 1 == r.height) && r.triangle[r.index(i, j)] >= 0)
        edge[r.index(i, j)] = 1;
    }
  for (std::size_t k = 0; k < edge.size(); ++k) border[k] |= edge[k];
  // A sensor mixes two pixels each way, and the outline is as sure as the pose is: 3 sigma, of directions that are held
  // at all; the flagged pixels are the first of the way.
  const double pixel_mm = (pose * part.box_center()).z() / scene.camera.fx;
  const double place = std::sqrt(motion_variance(instance, pose * part.box_center()) / 3);
  const double reach_px = 2 + std::min(3 * place / pixel_mm, 4.0);
  const int n = std::max(0, static_cast<int>(std::ceil(reach_px / out.step)) - 1);
  dilate(edge, r.width, r.height, n);
  dilate(border, r.width, r.height, n);
  out.inner.assign(edge.size(), 0);
  out.inner_primitive.assign(edge.size(), 0);
  for (std::size_t k = 0; k < edge.size(); ++k) {
    out.inner[k] = r.triangle[k] >= 0 && !edge[k];
    out.inner_primitive[k] = r.triangle[k] >= 0 && !border[k] && out.primitive(part, k) > 0;
  }
  out.mirrored = mirrored_pixels(part, scene, r);
  return out;
}

}  // namespace tribin
