#include "tribin/paper_method/objects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace tribin::paper {
namespace {

/// Planes that reach further than any part does: the table, a wall.
std::vector<const Primitive*> backgrounds(const Primitives& primitives, const Surfels& surfels, double largest_mm) {
  std::vector<const Primitive*> out;
  for (const Primitive& p : primitives.items) {
    if (p.type != PrimitiveType::plane) continue;
    double furthest = 0;
    for (std::uint32_t i : p.surfels)
      furthest = std::max(furthest, (surfels.position[i].cast<double>() - p.point).norm());
    // Of a part's own face nothing lies further from its centre than a diameter.
    if (furthest > 1.1 * largest_mm) out.push_back(&p);
  }
  return out;
}

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// The cluster of each surfel in `kept`: cubes of the gap's size that touch are one cluster.
std::vector<std::uint32_t> clusters(const Surfels& surfels, const std::vector<std::uint32_t>& kept, double gap_mm) {
  std::map<std::array<int, 3>, std::uint32_t> cubes;
  std::vector<std::uint32_t> cube_of(kept.size()), parent;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const Vec3f& x = surfels.position[kept[k]];
    const std::array<int, 3> key = {static_cast<int>(std::floor(x.x() / gap_mm)),
                                    static_cast<int>(std::floor(x.y() / gap_mm)),
                                    static_cast<int>(std::floor(x.z() / gap_mm))};
    const auto [at, made] = cubes.emplace(key, static_cast<std::uint32_t>(parent.size()));
    if (made) parent.push_back(at->second);
    cube_of[k] = at->second;
  }
  for (const auto& [key, cube] : cubes)
    for (int n = 0; n < 27; ++n) {
      const auto next = cubes.find({key[0] + n % 3 - 1, key[1] + n / 3 % 3 - 1, key[2] + n / 9 - 1});
      if (next == cubes.end()) continue;
      const std::uint32_t a = root_of(parent, cube), b = root_of(parent, next->second);
      parent[std::max(a, b)] = std::min(a, b);
    }
  std::vector<std::uint32_t> out(kept.size());
  for (std::size_t k = 0; k < kept.size(); ++k) out[k] = root_of(parent, cube_of[k]);
  return out;
}

double area_of(const Object& object, const Surfels& surfels) {
  double area = 0;
  for (std::uint32_t i : object.surfels) area += surfels.area_mm2[i];
  return area;
}

void give_primitives(const Primitives& primitives, const PrimitiveModel& observation, std::vector<Object>& objects) {
  std::vector<std::map<int, int>> counts(objects.size());  // primitive id -> surfels of it
  for (std::size_t k = 0; k < objects.size(); ++k)
    for (std::uint32_t i : objects[k].surfels) ++counts[k][primitives.label_of_surfel[i]];
  for (const Primitive& p : observation.primitives)
    for (std::size_t k = 0; k < objects.size(); ++k) {
      const auto count = counts[k].find(p.id);
      if (count == counts[k].end() || 2 * static_cast<std::size_t>(count->second) <= p.surfels.size()) continue;
      if (p.type == PrimitiveType::plane) objects[k].planes.push_back(&p);
      if (p.type == PrimitiveType::cylinder && !p.concave) objects[k].cylinders.push_back(&p);
    }
  for (Object& object : objects) {
    std::stable_sort(object.cylinders.begin(), object.cylinders.end(),
                     [](const Primitive* a, const Primitive* b) { return a->radius_mm > b->radius_mm; });
    std::stable_sort(object.planes.begin(), object.planes.end(),
                     [](const Primitive* a, const Primitive* b) { return a->area_mm2 > b->area_mm2; });
  }
}

}  // namespace

std::vector<Object> objects_in(const Primitives& primitives, const PrimitiveModel& observation, const Surfels& surfels,
                               double largest_mm, double smallest_mm) {
  const std::vector<const Primitive*> tables = backgrounds(primitives, surfels, largest_mm);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i < surfels.size(); ++i) {
    const Vec3 x = surfels.position[i].cast<double>();
    const bool on_table = std::any_of(tables.begin(), tables.end(), [&](const Primitive* p) {
      // Within 1 % of the smallest part: the cells along the foot of an object see both.
      return std::abs(p->axis.dot(x) - p->offset_mm) < std::max(3.0 * surfels.sigma_mm[i], 0.01 * smallest_mm);
    });
    if (!on_table) kept.push_back(i);
  }
  const std::vector<std::uint32_t> cluster = clusters(surfels, kept, 0.05 * smallest_mm);
  std::map<std::uint32_t, Object> by_cluster;
  for (std::size_t k = 0; k < kept.size(); ++k) by_cluster[cluster[k]].surfels.push_back(kept[k]);
  std::vector<Object> out;
  for (auto& [root, object] : by_cluster) out.push_back(std::move(object));
  std::stable_sort(out.begin(), out.end(),
                   [&](const Object& a, const Object& b) { return area_of(a, surfels) > area_of(b, surfels); });
  give_primitives(primitives, observation, out);
  return out;
}

}  // namespace tribin::paper
