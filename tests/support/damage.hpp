#pragma once

#include <algorithm>
#include <cmath>
#include <map>

#include "tribin/cad/mesh.hpp"

namespace tribin::test {

/// The mesh with each triangle split into four until no edge within `radius` of a point is longer than `edge`.
inline Mesh finer_near(const Mesh& mesh, const Vec3& at, double radius, double edge) {
  Mesh out = mesh;
  for (bool again = true; again;) {
    again = false;
    Mesh next = out;
    next.triangles.clear();
    next.face_of_triangle.clear();
    for (std::size_t t = 0; t < out.triangles.size(); ++t) {
      const auto corner = out.triangles[t];
      const int face = out.face_of_triangle.empty() ? 0 : out.face_of_triangle[t];
      const auto add = [&](std::array<std::uint32_t, 3> c) {
        next.triangles.push_back(c);
        if (!out.face_of_triangle.empty()) next.face_of_triangle.push_back(face);
      };
      double longest = 0, nearest = 1e30;
      Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3d a = out.vertices[corner[k]].cast<double>(),
                              b = out.vertices[corner[(k + 1) % 3]].cast<double>();
        longest = std::max(longest, (a - b).norm());
        low = low.cwiseMin(a), high = high.cwiseMax(a);
      }
      nearest = (Eigen::Vector3d(at).cwiseMax(low).cwiseMin(high) - Eigen::Vector3d(at)).norm();
      if (longest <= edge || nearest > radius) {
        add(corner);
        continue;
      }
      again = true;
      std::array<std::uint32_t, 3> middle;
      for (std::size_t k = 0; k < 3; ++k) {
        middle[k] = static_cast<std::uint32_t>(next.vertices.size());
        next.vertices.push_back(0.5f * (out.vertices[corner[k]] + out.vertices[corner[(k + 1) % 3]]));
      }
      add({corner[0], middle[0], middle[2]});
      add({middle[0], corner[1], middle[1]});
      add({middle[2], middle[1], corner[2]});
      add({middle[0], middle[1], middle[2]});
    }
    out = std::move(next);
  }
  return out;
}

/// A dent pressed into a surface: round, `depth` deep over its middle, smooth to nothing at `radius`.
inline Mesh with_dent(const Mesh& mesh, const Vec3& at, const Vec3& outward, double radius, double depth) {
  Mesh out = finer_near(mesh, at, radius, radius / 6);
  for (Vec3f& v : out.vertices) {
    const double distance = (v.cast<double>() - at).norm() / radius;
    if (distance < 1)
      out.vertices[&v - out.vertices.data()] -= (depth * std::min(1.0, 2 * (1 - distance)) * outward).cast<float>();
  }
  return out;
}

/// All that lies beyond a plane (n . x > offset) pressed onto it: an ear broken off.
inline Mesh broken_off(const Mesh& mesh, const Vec3& normal, double offset) {
  Mesh out = mesh;
  for (Vec3f& v : out.vertices) {
    const double beyond = normal.dot(v.cast<double>()) - offset;
    if (beyond > 0) v -= (beyond * normal).cast<float>();
  }
  return out;
}

/// The part with everything within `within` of an axis (through `point`) moved outward by `by`: a bore or a journal of
/// another radius.
inline Mesh with_other_radius(const Mesh& mesh, const Vec3& axis, const Vec3& point, double radius, double by) {
  Mesh out = mesh;
  for (Vec3f& v : out.vertices) {
    const Vec3 d = v.cast<double>() - point;
    const Vec3 across = d - axis * axis.dot(d);
    if (std::abs(across.norm() - radius) < 0.01 * radius) v += (by / across.norm() * across).cast<float>();
  }
  return out;
}

}  // namespace tribin::test
