#include "tribin/cad/measure.hpp"

#include <algorithm>
#include <cmath>

namespace tribin {

Box bounding_box(std::span<const Vec3f> points) {
  Box box;
  for (const Vec3f& p : points) {
    box.min = box.min.cwiseMin(Vec3(p.cast<double>()));
    box.max = box.max.cwiseMax(Vec3(p.cast<double>()));
  }
  return box;
}

double diameter(std::span<const Vec3f> points) {
  if (points.empty()) return 0;
  const Vec3 center = bounding_box(points).center();
  struct Far {
    Vec3 p;
    double r;
  };
  std::vector<Far> far;
  far.reserve(points.size());
  for (const Vec3f& p : points) far.push_back({Vec3(p.cast<double>()), (p.cast<double>() - center).norm()});
  std::sort(far.begin(), far.end(), [](const Far& a, const Far& b) { return a.r > b.r; });
  // A good start by three sweeps to the farthest point; then a pair can only win while r_i + r_j > best.
  double best = 0;
  Vec3 from = far.front().p;
  for (int sweep = 0; sweep < 3; ++sweep) {
    Vec3 to = from;
    for (const Far& f : far) {
      if ((f.p - from).norm() > best) {
        best = (f.p - from).norm();
        to = f.p;
      }
    }
    from = to;
  }
  for (std::size_t i = 0; i < far.size() && 2 * far[i].r > best; ++i) {
    for (std::size_t j = i + 1; j < far.size() && far[i].r + far[j].r > best; ++j) {
      best = std::max(best, (far[i].p - far[j].p).norm());
    }
  }
  return best;
}

double surface_area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
               c = mesh.vertices[t[2]].cast<double>();
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

double signed_volume(const Mesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  const Vec3 origin = bounding_box(mesh.vertices).center();  // near the mesh: less cancellation
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>() - origin, b = mesh.vertices[t[1]].cast<double>() - origin,
               c = mesh.vertices[t[2]].cast<double>() - origin;
    sum += a.dot(b.cross(c)) / 6;
  }
  return sum;
}

}  // namespace tribin
