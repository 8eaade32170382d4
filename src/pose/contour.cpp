#include "tribin/pose/contour.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "outline_side.hpp"
#include "raster.hpp"

namespace tribin {
namespace {

// A hard edge between two pixel centres is uniform within one pixel: sd 0.29 px; mixed pixels and the mesh's facets
// make it about 0.5 px. Neighbouring samples share their pixel's error: their equations count half.
constexpr double kEdgeSigmaPx = 0.5;
constexpr double kSampleWeight = 0.5;
constexpr double kSteepest = 0.42;  // cos 65 deg

/// Pixel nearest to a place right of -1. (std::lround is a call.)
int nearest_pixel(double x) { return static_cast<int>(std::min(x, 1e6) + 1.5) - 1; }

/// Is the scan at pixel (x, y) the plane n . p = rho, up to noise and a pixel's slope?
bool on_surface(const SceneDepth& scene, double x, double y, const Eigen::Vector3d& n, double rho) {
  if (!(x > -1 && y > -1)) return false;
  const int u = nearest_pixel(x), v = nearest_pixel(y);
  if (!scene.z_mm.contains(u, v)) return false;
  const float z = scene.z_mm(u, v);
  if (!(z > 0)) return false;
  const Eigen::Vector3d ray = scene.camera.ray(u, v);
  const double slant = std::abs(n.dot(ray));
  const double r = n.dot(ray) * z - rho;
  return std::abs(r) < 6 * scene.sigma_mm(u, v) * slant + z / scene.camera.fx;
}

/// Signed place of the scan's edge along m from (x, y) [px], nearest to 0; NaN if there is none within reach.
double edge_along(const SceneDepth& scene, double x, double y, const Vec2& m, const Eigen::Vector3d& n, double rho,
                  double reach) {
  // Places k - half along m, looked at when asked for: most edges lie near 0.
  const int half = std::min(static_cast<int>(std::ceil(reach)) + 2, 31);
  std::array<std::int8_t, 64> known{};
  const auto on = [&](int k) {
    std::int8_t& at = known[static_cast<std::size_t>(k)];
    if (at == 0) at = on_surface(scene, x + (k - half) * m[0], y + (k - half) * m[1], n, rho) ? 1 : -1;
    return at > 0;
  };
  for (int away = 0; away < half - 1; ++away)
    for (const int k : {half - 1 - away, half + away}) {
      const double s = k - half + 0.5;
      if (k < 1 || k + 2 > 2 * half || std::abs(s) > reach) continue;
      // Two on, two off: a single stray pixel is no edge.
      if (on(k) && !on(k + 1) && on(k - 1) && !on(k + 2)) return s;
    }
  return std::nan("");
}

}  // namespace

ContourSums contour_sums(const RenderMesh& mesh, const SceneDepth& scene, const Pose& camera_from_part,
                         const IndexRender& render, const Vec3& center, double reach_px) {
  ContourSums out;
  if (render.width == 0) return out;
  const PinholeCamera& camera = scene.camera;
  const Eigen::Matrix3d rotation = camera_from_part.linear();
  const double inverse_step = 1.0 / render.step;
  // A shade is as wide as what throws it is high.
  const int across = std::max(render.width, render.height) * render.step / 2;
  double squares = 0, weights = 0;
  Eigen::Matrix<double, 6, 6> h = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
  const Vec3f eye = Vec3f((-(rotation.transpose() * camera_from_part.translation())).cast<float>());
  // One byte a triangle, and one that stands for the open side of borders.
  thread_local std::vector<float> side;
  thread_local std::vector<std::uint8_t> front;
  const std::size_t triangles = mesh.triangles.size();
  side.resize(triangles);
  front.assign(triangles + 1, 0);
  raster::sides_of_camera(mesh.normals.data()->data(), mesh.offsets.data(), triangles, eye, side.data());
  for (std::size_t k = 0; k < triangles; ++k) front[k] = side[k] > 0;
  const std::uint8_t* faces_camera = front.data();
  for (const OutlineEdge& edge : mesh.edges) {
    const auto at = [&](std::int32_t t) { return t < 0 ? triangles : static_cast<std::size_t>(t); };
    const std::uint8_t front0 = faces_camera[at(edge.triangles[0])], front1 = faces_camera[at(edge.triangles[1])];
    if (front0 == front1) continue;
    const Eigen::Vector3d p0 = camera_from_part * mesh.vertices[edge.vertices[0]].cast<double>();
    const Eigen::Vector3d p1 = camera_from_part * mesh.vertices[edge.vertices[1]].cast<double>();
    if (p0.z() <= 1 || p1.z() <= 1) continue;
    const auto seen = static_cast<std::size_t>(edge.triangles[front0 ? 0 : 1]);
    const Eigen::Vector3d n = rotation * mesh.normals[seen].cast<double>();
    const double rho = n.dot(p0);
    if (-rho / p0.norm() < kSteepest) continue;
    const Vec2 a = camera.project(Vec3(p0)), e = camera.project(Vec3(p1));
    Vec2 along = e - a;
    const double length = along.norm();
    if (length < 1e-6) continue;
    const int count = std::max(1, static_cast<int>(length / render.step));
    const double weight = kSampleWeight * length / count;
    along /= length;
    Vec2 m(along[1], -along[0]);
    // Outward: away from the seen facet's third vertex.
    for (const std::uint32_t k : mesh.triangles[seen]) {
      if (k == edge.vertices[0] || k == edge.vertices[1]) continue;
      const Vec2 third = camera.project(Vec3(camera_from_part * mesh.vertices[k].cast<double>()));
      if (m.dot(third - a) > 0) m = -m;
    }
    for (int k = 0; k < count; ++k) {
      const double f = (k + 0.5) / count;
      // Perspective: equal steps on the screen.
      const double w = (1 - f) / p0.z() + f / p1.z();
      const Vec2 q = a + along * (f * length);
      const double z = 1 / w;
      // Seen there, and nothing of the part beyond?
      const auto rendered = [&](double s, float& inverse_z) {
        const double x = (q[0] + s * m[0] - render.u0) * inverse_step;
        const double y = (q[1] + s * m[1] - render.v0) * inverse_step;
        if (!(x > -0.5 && y > -0.5)) return false;
        const int i = nearest_pixel(x), j = nearest_pixel(y);
        if (i >= render.width || j >= render.height) return false;
        const std::size_t at = render.index(i, j);
        inverse_z = render.inverse_z[at];
        return render.triangle[at] >= 0;
      };
      float inside = 0, outside = 0;
      const double margin = 1.2 * render.step;
      if (!rendered(-margin, inside) || std::abs(1 / inside - z) > 0.01 * z) continue;
      if (rendered(margin, outside) && 1 / outside - z < 0.01 * z) continue;
      const double s = edge_along(scene, q[0], q[1], m, n, rho, reach_px);
      if (!(std::abs(s) <= reach_px)) continue;
      // The edge of something in front is not the part's.
      const Vec2 edge_at = q + m * (s + 0.5);
      const double tolerance = 6 * scene.median_sigma_mm + z / camera.fx;
      if (look_beside(scene, edge_at[0], edge_at[1], m[0], m[1], 1, 2, across, {n, rho, z}, tolerance) != Beside::ends)
        continue;
      const Eigen::Vector3d point = Eigen::Vector3d(camera.point(q[0], q[1], z));
      const Eigen::Vector3d g(m[0] * camera.fx * w, m[1] * camera.fy * w,
                              -(m[0] * camera.fx * point.x() + m[1] * camera.fy * point.y()) * w * w);
      Eigen::Matrix<double, 6, 1> jac;
      jac << g, (point - Eigen::Vector3d(center)).cross(g);
      const double robust = 1 / (1 + s * s);  // Cauchy with a scale of two edge sigmas
      const double wt = weight * robust / (kEdgeSigmaPx * kEdgeSigmaPx);
      h += wt * jac * jac.transpose();
      b += wt * jac * s;
      squares += weight * robust * s * s;
      weights += weight * robust;
      ++out.samples;
    }
  }
  out.information = h;
  out.pull = b;
  out.rms_px = weights > 0 ? std::sqrt(squares / weights) : 0;
  return out;
}

}  // namespace tribin
