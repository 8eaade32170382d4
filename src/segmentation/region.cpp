#include "segmentation/region.hpp"

#include <algorithm>
#include <cmath>

#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr int kReach = 2;  // cells: one rejected cell may lie between

/// Calls visit(j) for the neighbours of i, then bridge(j) for surfels up to kReach cells away that are no neighbours.
template <class Visit, class Bridge>
void around(const Surfels& s, std::uint32_t i, Visit&& visit, Bridge&& bridge) {
  for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) visit(s.neighbours[k]);
  if (s.scan == nullptr) return;
  const int width = s.surfel_of_cell.width;
  const int column = static_cast<int>(s.cell[i]) % width, row = static_cast<int>(s.cell[i]) / width;
  if (s.neighbour_begin[i + 1] - s.neighbour_begin[i] == 8) return;  // surrounded: nothing to bridge
  for (int dv = -kReach; dv <= kReach; ++dv)
    for (int du = -kReach; du <= kReach; ++du) {
      if (std::max(std::abs(du), std::abs(dv)) < kReach || !s.surfel_of_cell.contains(column + du, row + dv)) continue;
      // Only over a gap: the cell between has no surfel.
      if (s.surfel_of_cell(column + du / 2, row + dv / 2) >= 0) continue;
      const std::int32_t j = s.surfel_of_cell(column + du, row + dv);
      if (j >= 0) bridge(static_cast<std::uint32_t>(j));
    }
}

}  // namespace

Scene::Scene(const Surfels& s) : surfels(s), mark(s.size(), 0), labels_(s.size(), 0) {
  label = labels_;
  std::vector<float> areas(s.area_mm2);
  if (areas.empty()) return;
  std::nth_element(areas.begin(), areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2), areas.end());
  cell_mm = std::sqrt(areas[areas.size() / 2]);
}

Scene::Scene(const Scene* of)
    : surfels(of->surfels), label(of->label), mark(of->mark.size(), 0), cell_mm(of->cell_mm) {}

Scene Scene::fork() const { return Scene(this); }

std::vector<Indices> components(Scene& scene, std::span<const std::uint32_t> members, std::size_t least) {
  const Surfels& s = scene.surfels;
  const std::uint32_t waiting = ++scene.tick, done = ++scene.tick;
  for (std::uint32_t i : members) scene.mark[i] = waiting;
  std::vector<Indices> out;
  Indices queue;
  for (std::uint32_t first : members) {
    if (scene.mark[first] != waiting) continue;
    queue.assign(1, first);
    scene.mark[first] = done;
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const std::uint32_t i = queue[at];
      const auto take = [&](std::uint32_t j) {
        if (scene.mark[j] != waiting) return;
        scene.mark[j] = done;
        queue.push_back(j);
      };
      around(s, i, take, [&](std::uint32_t j) {
        if (scene.mark[j] != waiting) return;
        const Vec3f mean = (s.normal[i] + s.normal[j]).normalized();
        const double offset = std::abs(mean.dot(s.position[j] - s.position[i]));
        const double sigma = std::sqrt(s.sigma_mm[i] * s.sigma_mm[i] + s.sigma_mm[j] * s.sigma_mm[j]);
        if (offset < 0.15 * scene.cell_mm + 3.0 * sigma) take(j);
      });
    }
    if (queue.size() >= least) out.push_back(queue);
  }
  std::stable_sort(out.begin(), out.end(), [](const Indices& a, const Indices& b) { return a.size() > b.size(); });
  return out;
}

namespace {

/// A facet is inscribed in a surface when its corners lie on it and it looks where the surface does between them. What
/// the surface turns by from corner to corner bounds how far.
bool inscribed(const Surfels& s, std::uint32_t i, const Surface& surface) {
  constexpr double kSlack = 3.0 * kDegree;
  constexpr double kShare = 0.6;  // of the turn between corners: half of it on a ring of facets, more on slanted ones
  constexpr double kMostTurn = 0.8;  // 46 deg: beyond, a facet is a cap across the surface; circles have 10 and more
  Vec3 p[3];
  raw_points(s, i, p);
  const Vec3 n = s.normal[i].cast<double>();
  Vec3 normal[3], mean = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (std::abs(surface.distance(p[k])) > 4.0 * s.sigma_mm[i]) return false;
    normal[k] = surface.normal(p[k]);
  }
  for (int k = 0; k < 3; ++k) {
    const Vec3 q = p[k] - surface.point;
    // On the axis a cone has no normal: the other two corners say how it lies.
    if (surface.type == PrimitiveType::cone && (q - surface.axis * surface.axis.dot(q)).norm() < 4.0 * s.sigma_mm[i])
      normal[k] = (normal[(k + 1) % 3] + normal[(k + 2) % 3]).normalized();
    mean += normal[k];
  }
  double turn = 0, longest = 0, sagitta = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &from = p[k], &to = p[(k + 1) % 3];
    const double edge = (to - from).norm(), turned = (normal[(k + 1) % 3] - normal[k]).norm();
    // An arc bulges over its chord by an eighth of chord times turn: a plane that touches a torus along a circle has
    // triangles with all three corners there.
    const double bulge = std::abs(surface.distance(0.5 * (from + to)));
    if (bulge > 0.25 * edge * turned + 4.0 * s.sigma_mm[i]) return false;
    turn = std::max(turn, turned);
    sagitta = std::max(sagitta, bulge);
    longest = std::max(longest, edge);
  }
  if (turn > kMostTurn) return false;
  // Over its height a facet tilts by what its longest edge lies below the surface (Schwarz's lantern), and by its
  // corners' rounding.
  const double height = std::max(2.0 * s.area_mm2[i] / std::max(longest, 1e-9), 1e-9);
  const double limit = std::min(kShare * turn + kSlack + (sagitta + 2.0 * s.sigma_mm[i]) / height, kMostTurn);
  const double agree = mean.normalized().dot(n);
  return (s.oriented ? agree : std::abs(agree)) > std::cos(limit);
}

}  // namespace

bool fits(const Surfels& s, std::uint32_t i, const Surface& surface, double scale, double slack) {
  if (s.mesh != nullptr) return inscribed(s, i, surface);
  const Vec3 p = s.position[i].cast<double>();
  if (std::abs(misfit(s, i, surface)) > 4.0 * scale * s.sigma_mm[i]) return false;
  if (s.point_set != nullptr && s.sigma_normal[i] >= 1) return true;  // no normal: loose points beside edges
  const double limit = std::min(4.0 * scale * s.sigma_normal[i] + slack, 60.0 * kDegree);
  // 1 - x^2 / 2 + x^4 / 24 is the cosine to 1e-3 up to 60 deg, without a call per surfel.
  const double x2 = limit * limit;
  const double agree = surface.normal(p).dot(s.normal[i].cast<double>());
  return (s.oriented ? agree : std::abs(agree)) > 1.0 - x2 * (0.5 - x2 / 24.0);
}

Indices grow(Scene& scene, const Surface& surface, std::span<const std::uint32_t> seed, double scale, double slack) {
  const Surfels& s = scene.surfels;
  const std::uint32_t seen = ++scene.tick;
  Indices support;
  // A large region asks for most of the scene: all are tested ahead, in parallel.
  constexpr std::size_t kLarge = 4096;
  std::vector<std::uint8_t> on_surface;
  if (seed.size() > kLarge) {
    on_surface.resize(s.size());
    parallel_ranges(static_cast<int>(s.size()), 4096, [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        const auto k = static_cast<std::uint32_t>(i);
        on_surface[k] = scene.free(k) && fits(s, k, surface, scale, slack);
      }
    });
  }
  const auto consider = [&](std::uint32_t j) {
    if (scene.mark[j] == seen) return;
    scene.mark[j] = seen;
    const bool good = on_surface.empty() ? scene.free(j) && fits(s, j, surface, scale, slack) : on_surface[j] != 0;
    if (good) support.push_back(j);
  };
  for (std::uint32_t i : seed) consider(i);
  for (std::size_t at = 0; at < support.size(); ++at) around(s, support[at], consider, consider);
  return support;
}

double residual_correlation(Scene& scene, std::span<const std::uint32_t> support, const Surface& surface) {
  const Surfels& s = scene.surfels;
  const std::uint32_t inside = ++scene.tick;
  for (std::uint32_t i : support) scene.mark[i] = inside;
  const auto residual = [&](std::uint32_t i) { return misfit(s, i, surface) / s.sigma_mm[i]; };
  double products = 0, squares = 0;
  for (std::uint32_t i : support) {
    const double r = residual(i);
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      const std::uint32_t j = s.neighbours[k];
      if (scene.mark[j] != inside) continue;
      products += r * residual(j);
      squares += r * r;
    }
  }
  return squares > 0 ? products / squares : 0;
}

double smooth_rim_share(Scene& scene, std::span<const std::uint32_t> support) {
  const Surfels& s = scene.surfels;
  const std::uint32_t inside = ++scene.tick;
  for (std::uint32_t i : support) scene.mark[i] = inside;
  std::size_t rim = 0, smooth = 0;
  constexpr int kLeast = 2;                                               // of up to 8 neighbours
  const float cos_smooth = static_cast<float>(std::cos(12.0 * kDegree));  // a cell of width w bends by w / R
  for (std::uint32_t i : support) {
    int neighbours = 0, outside_free = 0, outside = 0;
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      const std::uint32_t j = s.neighbours[k];
      ++neighbours;
      if (scene.mark[j] == inside) continue;
      ++outside;
      outside_free += scene.free(j) && s.normal[i].dot(s.normal[j]) > cos_smooth;
    }
    if (outside == 0 && (neighbours == 8 || s.scan == nullptr)) continue;
    ++rim;
    smooth += outside_free >= kLeast;
  }
  return rim > 0 ? static_cast<double>(smooth) / static_cast<double>(rim) : 0;
}

double area_of(const Surfels& surfels, std::span<const std::uint32_t> support) {
  double area = 0;
  for (std::uint32_t i : support) area += surfels.area_mm2[i];
  return area;
}

}  // namespace tribin::segmentation_detail
