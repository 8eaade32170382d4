#include "views.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "tribin/core/parallel.hpp"
#include "tribin/core/thin_points.hpp"

namespace tribin {
namespace {

constexpr int kViewPixels = 96;      // the part's diameter spans this many pixels: detail of 1 % of the diameter
constexpr double kViewDistance = 6;  // diameters: near enough to a bin camera's perspective
constexpr std::size_t kViewPoints = 768;

/// Visits 0..n-1 once each in steps of the golden section, so that every prefix is spread evenly.
std::vector<std::uint32_t> golden_order(std::size_t n) {
  std::vector<std::uint32_t> order(n);
  if (n < 3) {
    std::iota(order.begin(), order.end(), 0u);
    return order;
  }
  std::size_t stride = static_cast<std::size_t>(static_cast<double>(n) * 0.6180339887498949) | 1u;
  while (std::gcd(stride, n) != 1) ++stride;
  std::size_t k = 0;
  for (std::size_t i = 0; i < n; ++i, k = (k + stride) % n) order[i] = static_cast<std::uint32_t>(k);
  return order;
}

/// Samples of all views together, thinned.
void sample_surface(Part& part) {
  constexpr std::size_t kOfAView = 200;  // some 3 % of the diameter apart: enough to thin to 5 %
  std::vector<Vec3f> points, normals;
  for (const PartView& view : part.views) {
    const auto n = static_cast<std::ptrdiff_t>(std::min(kOfAView, view.points.size()));
    points.insert(points.end(), view.points.begin(), view.points.begin() + n);
    normals.insert(normals.end(), view.normals.begin(), view.normals.begin() + n);
  }
  part.sample_points.clear();
  part.sample_normals.clear();
  for (const std::uint32_t i : thin_points(points, normals, 0.05 * part.diameter_mm)) {
    part.sample_points.push_back(points[i]);
    part.sample_normals.push_back(normals[i]);
  }
}

}  // namespace

std::vector<Vec3> view_directions() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3> v = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                         {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vec3& p : v) p.normalize();
  std::vector<std::array<int, 3>> f = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                       {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                       {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                       {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < 2; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto mid = [&](int a, int b) {
      const auto key = std::minmax(a, b);
      const auto it = middle.find(key);
      if (it != middle.end()) return it->second;
      const int id = static_cast<int>(v.size());
      v.push_back((v[static_cast<std::size_t>(a)] + v[static_cast<std::size_t>(b)]).normalized());
      middle.emplace(key, id);
      return id;
    };
    std::vector<std::array<int, 3>> next;
    for (const auto& t : f) {
      const int a = mid(t[0], t[1]), b = mid(t[1], t[2]), c = mid(t[2], t[0]);
      next.push_back({t[0], a, c});
      next.push_back({t[1], b, a});
      next.push_back({t[2], c, b});
      next.push_back({a, b, c});
    }
    f = std::move(next);
  }
  return v;
}

void make_views(Part& part) {
  const std::vector<Vec3> directions = view_directions();
  part.views.assign(directions.size(), {});
  std::vector<std::vector<double>> exposed(directions.size());
  const double distance = kViewDistance * part.diameter_mm;
  PinholeCamera camera;
  camera.width = camera.height = kViewPixels + 17;
  camera.fx = camera.fy = kViewPixels * kViewDistance;
  camera.cx = camera.cy = 0.5 * (camera.width - 1);

  parallel_each(static_cast<int>(directions.size()), [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    PartView& view = part.views[i];
    view.direction = directions[i];
    Vec3 x, y;
    orthonormal_basis(-view.direction, x, y);
    Pose pose = Pose::Identity();  // camera z looks along -direction at the box centre
    pose.linear().row(0) = x.transpose();
    pose.linear().row(1) = y.transpose();
    pose.linear().row(2) = -view.direction.transpose();
    pose.translation() = Eigen::Vector3d(0, 0, distance) - pose.linear() * Eigen::Vector3d(part.box_center());

    IndexRender render;
    render_index(part.render_mesh, camera, pose, 1, render);
    const Pose part_from_camera = pose.inverse();
    std::vector<std::uint32_t> seen;
    exposed[i].assign(part.model.primitives.size(), 0.0);
    for (std::size_t p = 0; p < render.triangle.size(); ++p) {
      if (render.triangle[p] < 0) continue;
      seen.push_back(static_cast<std::uint32_t>(p));
      const double side = 1.0 / (render.inverse_z[p] * camera.fx);
      view.area_mm2 += side * side;
      if (!part.primitive_of_triangle.empty()) {
        const std::int32_t id = part.primitive_of_triangle[static_cast<std::size_t>(render.triangle[p])];
        if (id > 0) exposed[i][static_cast<std::size_t>(id - 1)] += side * side;
      }
    }
    const std::vector<std::uint32_t> order = golden_order(seen.size());
    for (std::size_t n = 0; n < std::min(order.size(), kViewPoints); ++n) {
      const std::uint32_t p = seen[order[n]];
      const int u = render.u0 + static_cast<int>(p) % render.width, v = render.v0 + static_cast<int>(p) / render.width;
      view.points.push_back(
          (part_from_camera * Eigen::Vector3d(camera.point(u, v, 1.0 / render.inverse_z[p]))).cast<float>());
      const auto triangle = static_cast<std::size_t>(render.triangle[p]);
      view.normals.push_back((part_from_camera.linear() * render.normal[triangle].cast<double>()).cast<float>());
    }
  });
  sample_surface(part);
  part.exposed_mm2.assign(part.model.primitives.size(), 0.0);
  for (const auto& e : exposed)
    for (std::size_t j = 0; j < e.size(); ++j) part.exposed_mm2[j] += e[j] / static_cast<double>(directions.size());
}

const PartView& nearest_view(const Part& part, const Vec3& direction) {
  // 162 dot products: 0.1 us, less than a look-up table's cache miss is worth.
  std::size_t best = 0;
  double best_dot = -2;
  for (std::size_t i = 0; i < part.views.size(); ++i) {
    const double d = part.views[i].direction.dot(direction);
    if (d > best_dot) {
      best_dot = d;
      best = i;
    }
  }
  return part.views[best];
}

}  // namespace tribin
