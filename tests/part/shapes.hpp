#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tribin/cad/mesh.hpp"

namespace tribin::test {

using Outline = std::vector<Vec2>;  ///< a closed polygon, counter-clockwise

inline std::uint32_t add_vertex(Mesh& mesh, const Vec3& p) {
  const Vec3f q = p.cast<float>();
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (mesh.vertices[i] == q) return static_cast<std::uint32_t>(i);
  mesh.vertices.push_back(q);
  return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
}

inline void add_triangle(Mesh& mesh, const Vec3& a, const Vec3& b, const Vec3& c) {
  if ((b - a).cross(c - a).norm() < 1e-9) return;
  mesh.triangles.push_back({add_vertex(mesh, a), add_vertex(mesh, b), add_vertex(mesh, c)});
}

inline void add_quad(Mesh& mesh, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  add_triangle(mesh, a, b, c);
  add_triangle(mesh, a, c, d);
}

inline Outline regular_polygon(int corners, double radius) {
  Outline outline;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * kPi * i / corners;
    outline.push_back(radius * Vec2(std::cos(angle), std::sin(angle)));
  }
  return outline;
}

inline Outline rectangle(double x, double y) { return {{x, y}, {-x, y}, {-x, -y}, {x, -y}}; }

/// A body of revolution about z (or a prism, with few corners): rings of (radius, z), from the bottom up.
inline Mesh turned(const std::vector<std::array<double, 2>>& profile, int corners) {
  Mesh mesh;
  const auto at = [&](std::size_t ring, int i) {
    const double angle = 2 * kPi * (i % corners) / corners;
    return Vec3(profile[ring][0] * std::cos(angle), profile[ring][0] * std::sin(angle), profile[ring][1]);
  };
  for (int i = 0; i < corners; ++i) {
    add_triangle(mesh, {0, 0, profile.front()[1]}, at(0, i + 1), at(0, i));
    for (std::size_t r = 0; r + 1 < profile.size(); ++r)
      add_quad(mesh, at(r, i), at(r, i + 1), at(r + 1, i + 1), at(r + 1, i));
    add_triangle(mesh, {0, 0, profile.back()[1]}, at(profile.size() - 1, i), at(profile.size() - 1, i + 1));
  }
  return mesh;
}

inline Mesh box(double x, double y, double z) {
  Mesh mesh;
  const auto at = [&](int i) { return Vec3((i & 1) * x, (i >> 1 & 1) * y, (i >> 2 & 1) * z); };
  for (const auto& f : {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
    add_quad(mesh, at(f[0]), at(f[1]), at(f[2]), at(f[3]));
  return mesh;
}

/// A plate between z = 0 and z = height with a round through hole that all of its outline can be seen from.
inline Mesh plate_with_hole(const Outline& outline, double height, const Vec2& hole, double radius, int facets = 48) {
  const auto outside = [&](double angle) {
    const Vec2 d(std::cos(angle), std::sin(angle));
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vec2 a = outline[i] - hole, ab = outline[(i + 1) % outline.size()] - outline[i];
      const double cross = d.x() * ab.y() - d.y() * ab.x();
      const double t = (a.x() * ab.y() - a.y() * ab.x()) / cross, s = (a.x() * d.y() - a.y() * d.x()) / cross;
      if (t > 0 && s >= -1e-9 && s <= 1 + 1e-9) return Vec2(hole + t * d);
    }
    return hole;
  };
  std::vector<double> angles;
  for (int i = 0; i < facets; ++i) angles.push_back(-kPi + 2 * kPi * (i + 0.5) / facets);
  for (const Vec2& corner : outline) angles.push_back(std::atan2(corner.y() - hole.y(), corner.x() - hole.x()));
  std::sort(angles.begin(), angles.end());
  const auto lift = [](const Vec2& p, double z) { return Vec3(p.x(), p.y(), z); };
  const auto rim = [&](double angle) { return Vec2(hole + radius * Vec2(std::cos(angle), std::sin(angle))); };
  Mesh mesh;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double from = angles[i], to = angles[(i + 1) % angles.size()];
    const Vec2 a = rim(from), b = rim(to), c = outside(to), d = outside(from);
    add_quad(mesh, lift(a, height), lift(d, height), lift(c, height), lift(b, height));
    add_quad(mesh, lift(a, 0), lift(b, 0), lift(c, 0), lift(d, 0));
    add_quad(mesh, lift(d, 0), lift(c, 0), lift(c, height), lift(d, height));
    add_quad(mesh, lift(b, 0), lift(a, 0), lift(a, height), lift(b, height));
  }
  return mesh;
}

inline Pose random_pose(unsigned seed, double extent_mm = 100) {
  std::mt19937 random(seed);  // its numbers are the same everywhere; those of std's distributions are not
  const auto uniform = [&] { return random() / 4294967296.0; };
  const double a = uniform(), b = 2 * kPi * uniform(), c = 2 * kPi * uniform();
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(std::sqrt(a) * std::cos(c), std::sqrt(1 - a) * std::sin(b),
                                     std::sqrt(1 - a) * std::cos(b), std::sqrt(a) * std::sin(c))
                      .toRotationMatrix();
  pose.translation() = extent_mm * Vec3(2 * uniform() - 1, 2 * uniform() - 1, 2 * uniform() - 1);
  return pose;
}

inline Mesh moved(const Mesh& mesh, const Pose& pose) {
  Mesh result = mesh;
  for (Vec3f& v : result.vertices) v = (pose * v.cast<double>()).cast<float>();
  return result;
}

}  // namespace tribin::test
