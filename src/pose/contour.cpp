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

/// A facet's plane n . p = rho in the camera frame; n . ray is affine in the pixel.
struct FacetPlane {
  double along_u, along_v, along_0, rho;

  FacetPlane(const PinholeCamera& camera, const Eigen::Vector3d& n, double rho_mm)
      : along_u(n.x() / camera.fx),
        along_v(n.y() / camera.fy),
        along_0(n.z() - along_u * camera.cx - along_v * camera.cy),
        rho(rho_mm) {}
};

/// Is the scan at pixel (x, y) the plane, up to noise and a pixel's slope?
/// \param sigma_mm  of the depth around there.
bool on_surface(const SceneDepth& scene, double x, double y, const FacetPlane& plane, double sigma_mm) {
  if (!(x > -1 && y > -1)) return false;
  const int u = nearest_pixel(x), v = nearest_pixel(y);
  if (!scene.z_mm.contains(u, v)) return false;
  const double z = scene.z_mm(u, v);
  if (!(z > 0)) return false;
  const double along = plane.along_u * u + plane.along_v * v + plane.along_0;
  return std::abs(along * z - plane.rho) < 6 * sigma_mm * std::abs(along) + z / scene.camera.fx;
}

/// Signed place of the scan's edge along m from (x, y) [px], nearest to 0; NaN if there is none within reach.
double edge_along(const SceneDepth& scene, double x, double y, const Vec2& m, const FacetPlane& plane, double reach) {
  const double sigma_mm =
      scene.z_mm.contains(nearest_pixel(x), nearest_pixel(y)) ? scene.sigma_mm(nearest_pixel(x), nearest_pixel(y)) : 0;
  // Places k - half along m, looked at when asked for: most edges lie near 0.
  const int half = std::min(static_cast<int>(std::ceil(reach)) + 2, 31);
  std::array<std::int8_t, 64> known{};
  const auto on = [&](int k) {
    std::int8_t& at = known[static_cast<std::size_t>(k)];
    if (at == 0) at = on_surface(scene, x + (k - half) * m[0], y + (k - half) * m[1], plane, sigma_mm) ? 1 : -1;
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

/// The same where the sensor draws steps out: the edge is where the depth has gone half of the way from the part's to
/// that of what lies beyond. NaN where that is no farther than noise makes it, or nearer.
/// \param from, to  between them the step is sought, beyond them it is over.
double drawn_out_edge(const SceneDepth& scene, double x, double y, const Vec2& m, double z_mm, double from, double to,
                      int across) {
  const auto depth = [&](double s) -> double {
    const double px = x + s * m[0], py = y + s * m[1];
    if (!(px > -1 && py > -1)) return 0;
    const int u = nearest_pixel(px), v = nearest_pixel(py);
    return scene.z_mm.contains(u, v) && scene.z_mm(u, v) > 0 ? scene.z_mm(u, v) : 0;
  };
  double beyond = 0;
  for (double s = to; beyond == 0 && s <= to + across; ++s) beyond = depth(s);
  if (!(beyond - z_mm > 12 * scene.median_sigma_mm)) return std::nan("");
  const double half = 0.5 * (z_mm + beyond);
  const auto off = [&](double s) { return depth(s) == 0 || depth(s) > half; };
  // Two in a row: a single stray pixel is no edge.
  for (double s = from; s <= to; ++s)
    if (off(s) && off(s + 1)) return s - 0.5;
  return std::nan("");
}

/// An edge between a facet that looks at the camera and one that does not.
struct SilhouetteEdge {
  std::uint32_t from, to;  ///< vertices, in the facet's winding
  std::uint32_t facet;     ///< the one that looks at the camera
  float height_mm;         ///< of the camera above it
};

/// \param eye  the camera in the part frame [mm].
void find_silhouette(const RenderMesh& mesh, const Vec3f& eye, std::vector<SilhouetteEdge>& out) {
  thread_local std::vector<float> side;
  thread_local std::vector<std::uint8_t> front;
  thread_local std::vector<std::uint32_t> found;
  const std::size_t triangles = mesh.triangles.size();
  // One byte a triangle, and one before them that stands for the open side of borders.
  side.resize(triangles);
  front.assign(triangles + 1, 0);
  raster::sides_of_camera(mesh.normals.data()->data(), mesh.offsets.data(), triangles, eye, side.data());
  for (std::size_t k = 0; k < triangles; ++k) front[k + 1] = side[k] > 0;
  // Without a branch: which edges are silhouette cannot be predicted.
  found.resize(mesh.edges.size() + 1);
  std::size_t n = 0;
  for (std::size_t k = 0; k < mesh.edges.size(); ++k) {
    const OutlineEdge& e = mesh.edges[k];
    found[n] = static_cast<std::uint32_t>(k);
    n += front[static_cast<std::size_t>(e.triangles[0] + 1)] != front[static_cast<std::size_t>(e.triangles[1] + 1)];
  }
  out.clear();
  for (std::size_t k = 0; k < n; ++k) {
    const OutlineEdge& e = mesh.edges[found[k]];
    const auto facet = static_cast<std::uint32_t>(front[static_cast<std::size_t>(e.triangles[0] + 1)] ? e.triangles[0]
                                                                                                      : e.triangles[1]);
    const auto& t = mesh.triangles[facet];
    const std::uint32_t a = e.vertices[0], b = e.vertices[1];
    const bool along = (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
    out.push_back({along ? a : b, along ? b : a, facet, side[facet]});
  }
}

}  // namespace

ContourSums ContourSums::without_common(double share) const {
  ContourSums out = *this;
  out.information *= share;
  out.pull *= share;
  if (!(common_px > 0)) return out;
  const double known = share * share / (share * outward_weight + 1 / (common_px * common_px));
  out.information -= known * outward * outward.transpose();
  out.pull -= known * outward_pull * outward;
  return out;
}

void ContourSums::move(const Vector6& step) {
  pull -= information * step;
  outward_pull -= outward.dot(step);
}

ContourSums contour_sums(const RenderMesh& mesh, const SceneDepth& scene, const Pose& camera_from_part,
                         const IndexRender& render, const Vec3& center, double reach_px) {
  ContourSums out;
  if (render.width == 0) return out;
  const PinholeCamera& camera = scene.camera;
  const Eigen::Matrix3d rotation = camera_from_part.linear();
  const double inverse_step = 1.0 / render.step;
  // A shade is as wide as what throws it is high.
  const int across = std::max(render.width, render.height) * render.step / 2;
  const int rim = scene.rim(1);
  // Where steps are drawn out an edge is known to half of the blur, and neighbours within two blurs share their error.
  const double blur = scene.edge_blur_px, edge_variance = kEdgeSigmaPx * kEdgeSigmaPx + 0.25 * blur * blur;
  out.common_px = blur;
  out.held = kEdgeSigmaPx * kEdgeSigmaPx / edge_variance / (1 + 2 * blur);
  double squares = 0, weights = 0, outward_weight = 0, outward_pull = 0;
  Eigen::Matrix<double, 6, 1> outward = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 6> h = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
  thread_local std::vector<SilhouetteEdge> silhouette;
  find_silhouette(mesh, Vec3f((-(rotation.transpose() * camera_from_part.translation())).cast<float>()), silhouette);
  const Eigen::Matrix3f turn = rotation.cast<float>();
  const Eigen::Vector3f shift = camera_from_part.translation().cast<float>();
  for (const SilhouetteEdge& edge : silhouette) {
    const Eigen::Vector3f q0 = turn * mesh.vertices[edge.from] + shift, q1 = turn * mesh.vertices[edge.to] + shift;
    if (q0.z() <= 1 || q1.z() <= 1) continue;
    // The last facets of a round surface are all seen flat. Where steps are drawn out they do as well as others.
    if (rim == 0 && edge.height_mm < kSteepest * q0.norm()) continue;
    const Vec2 a = camera.project(Vec3(q0.cast<double>())), e = camera.project(Vec3(q1.cast<double>()));
    Vec2 along = e - a;
    const double length = along.norm();
    if (length < 1e-6) continue;
    const int count = std::max(1, static_cast<int>(length / render.step));
    const double weight = kSampleWeight * length / count;
    along /= length;
    const Vec2 m(-along[1], along[0]);  // outward: the facet turns left of its edges, seen with y down
    const double z0 = q0.z(), z1 = q1.z();
    const Eigen::Vector3d n = rotation * mesh.normals[edge.facet].cast<double>();
    const double rho = n.dot(q0.cast<double>());
    const FacetPlane plane(camera, n, rho);
    for (int k = 0; k < count; ++k) {
      const double f = (k + 0.5) / count;
      // Perspective: equal steps on the screen.
      const double w = (1 - f) / z0 + f / z1;
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
      double s = std::nan("");
      if (rim > 0) {
        // From where the part is seen: far inside, if its edge lies there.
        const double farthest = reach_px + rim;
        const auto there = [&](double in) {
          const Vec2 at = q - m * in;
          const int u = nearest_pixel(at[0]), v = nearest_pixel(at[1]);
          return rendered(-in, inside) && scene.z_mm.contains(u, v) &&
                 std::abs(scene.z_mm(u, v) - 1 / inside) < 6 * scene.median_sigma_mm;
        };
        double in = rim;
        while (in <= farthest && !there(in)) ++in;
        if (in <= farthest) s = drawn_out_edge(scene, q[0], q[1], m, z, -in, farthest, across);
      } else {
        s = edge_along(scene, q[0], q[1], m, plane, reach_px);
      }
      if (!(std::abs(s) <= reach_px)) continue;
      // The edge of something in front is not the part's.
      const Vec2 edge_at = q + m * (s + 0.5);
      const double tolerance = 6 * scene.median_sigma_mm + z / camera.fx;
      if (rim == 0 &&
          look_beside(scene, edge_at[0], edge_at[1], m[0], m[1], 1, 2, across, {n, rho, z}, tolerance) != Beside::ends)
        continue;
      const Eigen::Vector3d point = Eigen::Vector3d(camera.point(q[0], q[1], z));
      const Eigen::Vector3d g(m[0] * camera.fx * w, m[1] * camera.fy * w,
                              -(m[0] * camera.fx * point.x() + m[1] * camera.fy * point.y()) * w * w);
      Eigen::Matrix<double, 6, 1> jac;
      jac << g, (point - Eigen::Vector3d(center)).cross(g);
      const double robust = 1 / (1 + 0.25 * s * s / edge_variance);  // Cauchy with a scale of two edge sigmas
      const double wt = weight * robust / (kEdgeSigmaPx * kEdgeSigmaPx);
      h += wt * jac * jac.transpose();
      b += wt * jac * s;
      outward += wt * jac;
      outward_weight += wt;
      outward_pull += wt * s;
      squares += weight * robust * s * s;
      weights += weight * robust;
      ++out.samples;
    }
  }
  out.information = h;
  out.pull = b;
  out.outward = outward;
  out.outward_weight = outward_weight;
  out.outward_pull = outward_pull;
  out.rms_px = weights > 0 ? std::sqrt(squares / weights) : 0;
  return out;
}

}  // namespace tribin
