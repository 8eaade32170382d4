#pragma once

#include <random>

#include "support/arms.hpp"
#include "support/posed_scan.hpp"
#include "support/solids.hpp"
#include "tribin/grasp/grasp.hpp"

// Parts, grippers and scenes whose truth is known.
namespace tribin::grasp::test {

/// A closed prism over a regular polygon: many corners make a cylinder. Axis z, from 0 to the height.
inline Mesh cylinder_mesh(double radius, double height, int corners = 48, const char* name = "cylinder") {
  Mesh mesh;
  mesh.name = name;
  for (int i = 0; i < corners; ++i) {
    const double a = i * 2 * kPi / corners;
    for (const double z : {0.0, height})
      mesh.vertices.push_back(Vec3(radius * std::cos(a), radius * std::sin(a), z).cast<float>());
  }
  mesh.vertices.push_back(Vec3f(0, 0, 0));
  mesh.vertices.push_back(Vec3f(0, 0, static_cast<float>(height)));
  const std::uint32_t n = static_cast<std::uint32_t>(corners), low = 2 * n, high = 2 * n + 1;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % n);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
    mesh.triangles.push_back({low, b, a});
    mesh.triangles.push_back({high, a + 1, b + 1});
  }
  return mesh;
}

/// A ring: a bore of the inner radius along z.
inline Mesh ring_mesh(double outer, double inner, double height, int corners = 48) {
  Mesh mesh;
  mesh.name = "ring";
  for (int i = 0; i < corners; ++i) {
    const double a = i * 2 * kPi / corners;
    for (const double r : {inner, outer})
      for (const double z : {0.0, height})
        mesh.vertices.push_back(Vec3(r * std::cos(a), r * std::sin(a), z).cast<float>());
  }
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  const std::uint32_t n = static_cast<std::uint32_t>(corners);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = 4 * i, b = 4 * ((i + 1) % n);  // inner low, inner high, outer low, outer high
    quad(a + 2, b + 2, b + 3, a + 3);
    quad(b, a, a + 1, b + 1);
    quad(a + 3, b + 3, b + 1, a + 1);
    quad(a + 2, a, b, b + 2);
  }
  return mesh;
}

inline Mesh box_mesh(const Vec3& size, const char* name = "box") {
  Mesh soup;
  tribin::test::add_box(soup, Vec3f::Zero(), size.cast<float>());
  Mesh mesh;
  mesh.name = name;
  for (const auto& t : soup.triangles) {
    std::array<std::uint32_t, 3> welded{};
    for (int k = 0; k < 3; ++k) {
      const Vec3f p = soup.vertices[t[k]];
      std::uint32_t id = 0;
      while (id < mesh.vertices.size() && mesh.vertices[id] != p) ++id;
      if (id == mesh.vertices.size()) mesh.vertices.push_back(p);
      welded[k] = id;
    }
    mesh.triangles.push_back(welded);
  }
  return mesh;
}

/// A hand of 60 x 60 x 80 mm with fingers of 10 x 16 x 70 mm, the TCP 5 mm behind their tips.
inline Gripper jaws(double stroke = 100) {
  Gripper g;
  g.name = "jaws";
  g.stroke_mm = {0, stroke};
  g.force_n = 100;
  g.flange_from_tcp.translation() = Vec3(0, 0, 145);
  g.boxes = {{Vec3(0, 0, 40), Vec3(60, 60, 80)}};
  g.finger_mm = Vec3(10, 16, 70);
  g.tip_mm = 5;
  return g;
}

inline Gripper cup(double radius = 8) {
  Gripper g;
  g.name = "cup";
  g.kind = GripperKind::suction;
  g.force_n = 30;
  g.cup_radius_mm = radius;
  g.flange_from_tcp.translation() = Vec3(0, 0, 120);
  g.boxes = {{Vec3(0, 0, 30), Vec3(40, 40, 60)}};
  return g;
}

/// A part with its mesh, at one place in memory.
struct Known {
  explicit Known(const Mesh& m, const Gripper& gripper = jaws(), CellPart cell = {}) : part(compile_part(m)) {
    cell.name = part.name;
    grasps = prepare_grasps(part, cell, std::span<const Gripper>(&gripper, 1));
  }
  Known(const Known&) = delete;
  Part part;
  GraspPart grasps;
};

inline Pose at(double x, double y, double z, const Vec3& turn = Vec3::Zero()) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(turn);
  pose.translation() = Vec3(x, y, z);
  return pose;
}

/// Turned, and put down on z = 0 with its middle over a place.
inline Pose on_floor(const Part& part, double x, double y, const Vec3& turn = Vec3::Zero()) {
  Pose pose = at(0, 0, 0, turn);
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);
  for (const Vec3f& p : part.mesh.vertices) {
    const Vec3 q = pose * Vec3(p.cast<double>());
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  pose.translation() = Vec3(x - 0.5 * (low.x() + high.x()), y - 0.5 * (low.y() + high.y()), -low.z());
  return pose;
}

inline PartHere here(const Known& known, const Pose& base_from_part, double sigma_mm = 0.1) {
  PartHere part;
  part.part = &known.grasps;
  part.base_from_part = base_from_part;
  part.covariance.topLeftCorner<3, 3>() = Matrix3::Identity() * sigma_mm * sigma_mm;
  return part;
}

/// A camera a metre above the origin, looking down.
inline Pose camera_above(double height = 1000) { return at(0, 0, height, Vec3(kPi, 0, 0)); }

/// A bin of 300 x 240 x 100 mm on the floor, below that camera.
inline Scene in_bin() {
  Scene scene;
  scene.base_from_camera = camera_above();
  CellBin bin;
  bin.inner_size_mm = Vec3(300, 240, 100);
  scene.bin = bin;
  return scene;
}

inline const Known& rod() {
  static const Known known(cylinder_mesh(14, 60));
  return known;
}

/// What it sees of parts on the floor, and of other meshes.
inline Scan seen(const Scene& scene, std::vector<std::pair<const Mesh*, Pose>> others = {}, unsigned seed = 1) {
  std::vector<std::pair<const Mesh*, Pose>> things;
  const Pose camera_from_base = scene.base_from_camera.inverse();
  for (const PartHere& part : scene.parts)
    things.push_back({&part.part->part->mesh, camera_from_base * part.base_from_part});
  for (const auto& [mesh, pose] : others) things.push_back({mesh, camera_from_base * pose});
  const Vec3 normal = camera_from_base.linear() * Vec3::UnitZ();
  const double rho = normal.dot(camera_from_base.translation());
  return tribin::test::posed_scan(things, normal, rho, 0.05, 1, seed, 480, 384);
}

/// Points of a mesh's surface, at most `pitch` apart.
inline std::vector<Vec3> surface_points(const Mesh& mesh, double pitch) {
  std::vector<Vec3> out;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
               c = mesh.vertices[t[2]].cast<double>();
    const double longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
    const int n = std::max(1, static_cast<int>(std::ceil(longest / pitch)));
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) out.push_back(a + (b - a) * i / n + (c - a) * j / n);
  }
  return out;
}

/// Whether a point lies within a body, by its own box, disc and ball alone: an oracle that shares no code with gaps.
inline bool holds(const Convex& body, const Vec3& point) {
  Vec3 p = body.frame_from_body.inverse() * point;
  for (int k = 0; k < 3; ++k) p[k] -= std::clamp(p[k], -body.half_mm[k], body.half_mm[k]);
  const double across = p.head<2>().norm();
  if (across > 0) p.head<2>() *= std::max(0.0, across - body.disc_mm) / across;
  return p.norm() <= body.radius_mm + 1e-9;
}

}  // namespace tribin::grasp::test
