#include "bin_space.hpp"

#include <algorithm>

namespace tribin::grasp {

std::vector<Convex> bin_bodies(const CellBin& bin) {
  const double x = bin.inner_size_mm.x(), y = bin.inner_size_mm.y(), z = bin.inner_size_mm.z(), w = bin.wall_mm;
  std::vector<Convex> bodies;
  const auto add = [&](const Vec3& center, const Vec3& size) {
    Pose pose = Pose::Identity();
    pose.translation() = center;
    bodies.push_back(make_box(bin.base_from_bin * pose, size));
  };
  add(Vec3(0, 0, -w / 2), Vec3(x + 2 * w, y + 2 * w, w));
  for (const int side : {-1, 1}) {
    add(Vec3(side * (x + w) / 2, 0, z / 2), Vec3(w, y + 2 * w, z));
    add(Vec3(0, side * (y + w) / 2, z / 2), Vec3(x, w, z));
  }
  return bodies;
}

double lowest_along(const std::vector<Convex>& bodies, const Vec3& up) {
  double low = 1e300;
  for (const Convex& body : bodies) low = std::min(low, -reach_along(body, -up));
  return low;
}

double way_over_rim(const CellBin& bin, const std::vector<Convex>& bodies, double clearance) {
  const Vec3 up = bin.base_from_bin.linear().col(2);
  const double rim = up.dot(bin.base_from_bin.translation()) + bin.inner_size_mm.z() + clearance;
  // A bin that stands on its side has no way up over its rim: what is given then is not in reach, and refused for it.
  return std::max(0.0, rim - lowest_along(bodies, up)) / std::max(up.z(), 0.1);
}

double least_gap(const std::vector<Convex>& a, const std::vector<Convex>& b, double enough) {
  double least = enough;
  for (const Convex& one : a)
    for (const Convex& other : b) {
      least = std::min(least, distance_mm(one, other, least));
      if (least == 0) return 0;
    }
  return least;
}

std::vector<Convex> swept(const std::vector<Convex>& bodies, const Pose& base_from_frame, const Vec3& move) {
  std::vector<Convex> out;
  for (const Convex& body : bodies) {
    out.push_back(moved(base_from_frame, body));
    out.back().sweep_mm += move;
  }
  return out;
}

}  // namespace tribin::grasp
