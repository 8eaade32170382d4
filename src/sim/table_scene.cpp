#include "tribin/sim/table_scene.hpp"

#include <algorithm>
#include <cmath>

#include "sim/random.hpp"

namespace tribin::sim {

Mesh table_mesh(double side_mm) {
  const float s = static_cast<float>(side_mm / 2);
  Mesh mesh;
  mesh.vertices = {{-s, -s, 0}, {s, -s, 0}, {s, s, 0}, {-s, s, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.name = "table";
  return mesh;
}

Pose camera_above(double distance_mm, double tilt, double azimuth) {
  // The camera leans about a level axis through the table's origin, so that the distance stays.
  const Vec3 axis(-std::sin(azimuth), std::cos(azimuth), 0);
  Pose camera_from_table = Pose::Identity();
  Matrix3 down = Matrix3::Identity();  // image x along the table's x, image y against its y, z down
  down(1, 1) = down(2, 2) = -1;
  camera_from_table.linear() = down * rotation_from_vector(axis * tilt);
  camera_from_table.translation() = Vec3(0, 0, distance_mm);
  return camera_from_table;
}

Pose placed(const StableRest& rest, double yaw, double x, double y) {
  Pose turn = Pose::Identity();
  turn.linear() = rotation_from_vector(Vec3(0, 0, yaw));
  turn.translation() = Vec3(x, y, 0);
  return turn * rest.table_from_part;
}

double radius_from_above(const Mesh& mesh, const StableRest& rest) {
  double r = 0;
  for (const Vec3f& v : mesh.vertices) {
    const Vec3 p = rest.table_from_part * Vec3(v.cast<double>());
    r = std::max(r, std::hypot(p.x(), p.y()));
  }
  return r;
}

Layout lay_on_table(const std::vector<TablePart>& parts, double half_width, double half_height, std::uint64_t seed) {
  constexpr double kGap = 3;  // mm between bounding circles
  Random random(seed);
  Layout layout;
  struct Circle {
    double x, y, r;
  };
  std::vector<Circle> circles;
  for (int i = 0; i < static_cast<int>(parts.size()); ++i) {
    double draw = random.uniform();
    std::size_t k = 0;
    const std::vector<StableRest>& rests = *parts[i].rests;
    while (k + 1 < rests.size() && draw >= rests[k].probability) draw -= rests[k++].probability;
    const double r = radius_from_above(*parts[i].mesh, rests[k]);
    const double yaw = random.uniform(0, 2 * kPi);
    const double room_x = std::max(0.0, half_width - r), room_y = std::max(0.0, half_height - r);
    for (int attempt = 0; attempt < 500; ++attempt) {
      const Circle c{random.uniform(-room_x, room_x), random.uniform(-room_y, room_y), r};
      const bool free = std::none_of(circles.begin(), circles.end(), [&](const Circle& o) {
        return std::hypot(o.x - c.x, o.y - c.y) < o.r + c.r + kGap;
      });
      if (!free) continue;
      circles.push_back(c);
      layout.laid.push_back(i);
      layout.table_from_part.push_back(placed(rests[k], yaw, c.x, c.y));
      break;
    }
  }
  return layout;
}

}  // namespace tribin::sim
