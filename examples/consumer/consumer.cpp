// Makes a scan and a part by hand, finds the part, and prints where it is. Built with other -m flags than tribin
// itself: the types of the interface must have the same layout on both sides.

#include <cmath>
#include <cstdio>
#include <limits>

#include "tribin/core/error.hpp"
#include "tribin/finder/finder.hpp"

namespace {

/// A box of 60 x 40 x 30 mm, centre at the origin.
tribin::Mesh box() {
  tribin::Mesh mesh;
  mesh.name = "box";
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back({i & 1 ? 30.f : -30.f, i & 2 ? 20.f : -20.f, i & 4 ? 15.f : -15.f});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// What a camera 600 mm above a table sees of that box, turned so that three faces show.
tribin::Scan scan_of_box(const tribin::Pose& camera_from_box) {
  tribin::Scan scan;
  scan.camera = {320, 256, 900, 900, 159.5, 127.5};
  scan.z_mm = tribin::Image<float>(320, 256, 600.f);
  scan.noise = {.sigma_mm = 0.05, .correlation_px = 0};
  const tribin::Pose box_from_camera = camera_from_box.inverse();
  const tribin::Vec3 half(30, 20, 15), origin = box_from_camera.translation();
  unsigned state = 1;
  for (int v = 0; v < 256; ++v) {
    for (int u = 0; u < 320; ++u) {
      const tribin::Vec3 ray = box_from_camera.linear() * scan.camera.ray(u, v);
      double enter = 0, leave = 600;
      for (int k = 0; k < 3; ++k) {
        const double a = (-half[k] - origin[k]) / ray[k], b = (half[k] - origin[k]) / ray[k];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
      }
      state = state * 1664525u + 1013904223u;
      const float noise = 0.05f * 3.46f * (static_cast<float>(state >> 8) / 16777216.f - 0.5f);
      if (enter < leave && enter > 0) scan.z_mm(u, v) = static_cast<float>(enter);
      scan.z_mm(u, v) += noise;
    }
  }
  return scan;
}

}  // namespace

int main() {
  try {
    tribin::Pose truth = tribin::Pose::Identity();
    truth.linear() = tribin::rotation_from_vector({0.5, 0.4, 0.3});
    truth.translation() = tribin::Vec3(10, -5, 560);
    const tribin::Scan scan = scan_of_box(truth);
    const std::vector<tribin::Part> parts = {tribin::compile_part(box())};
    const tribin::Found found = tribin::find_parts(scan, parts);
    std::printf("status %s, %zu planes seen\n", found.status.c_str(), found.primitives.items.size());
    for (const tribin::Instance& instance : found.instances.items) {
      const tribin::Vec3 t = instance.camera_from_part.translation();
      std::printf("%s at %.3f %.3f %.3f mm, score %.3f\n", instance.part.c_str(), t.x(), t.y(), t.z(), instance.score);
      if ((t - tribin::Vec3(truth.translation())).norm() < 0.2) return 0;
    }
    std::printf("the box was not found where it is\n");
    return 1;
  } catch (const tribin::Error& e) {
    std::printf("error %d: %s\n", static_cast<int>(e.code()), e.what());
    return 2;
  }
}
