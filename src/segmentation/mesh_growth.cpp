#include "segmentation/mesh_growth.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <queue>

#include "segmentation/mesh_starts.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::segmentation_detail {
namespace {

/// Facets about a seed: few along the long edges find a narrow band among its fillets, many hold a weak curvature.
struct Reach {
  std::size_t facets;
  bool along_long_edges;
};
constexpr Reach kReaches[] = {{8, true}, {12, false}, {24, true}, {40, false}};

constexpr int kLeastTurns = 4;  // facets that differ in direction: three fit a cylinder by symmetry alone
constexpr int kProof = 4;       // corners beyond those that any surface of the type goes through
// Of a rim that goes on: true cones have 0-0.2, rows cut out of free form 0.25-0.8; a fillet goes on round its corners.
constexpr double kMostGoesOn = 0.4, kMostGoesOnCone = 0.22;
constexpr double kSame = 0.95;            // of the area: what explains as much is as good
constexpr std::size_t kMostInVain = 400;  // seeds in a row that find nothing: what is left is free form
constexpr std::size_t kBatch = 16;        // seeds looked at in parallel
constexpr int kMostRounds = 12;           // of growth: each may double the surface

struct Candidate {
  FoundSurface found;
  double area = 0;
  double sagitta = 0;  ///< of the facets' edges under the surface, mean by area [mm]
};

/// Facets about a seed that are free, the seed first.
Indices around(Scene& scene, std::uint32_t seed, const Reach& reach) {
  const Surfels& s = scene.surfels;
  const std::uint32_t seen = ++scene.tick;
  using Entry = std::pair<double, std::uint32_t>;  // priority, facet
  const auto after = [](const Entry& a, const Entry& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  };
  std::priority_queue<Entry, std::vector<Entry>, decltype(after)> queue(after);
  queue.emplace(0.0, seed);
  scene.mark[seed] = seen;
  Indices out;
  double step = 0;
  while (!queue.empty() && out.size() < reach.facets) {
    const std::uint32_t i = queue.top().second;
    queue.pop();
    out.push_back(i);
    for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
      const std::uint32_t j = s.neighbours[k];
      if (scene.mark[j] == seen || !scene.free(j)) continue;
      scene.mark[j] = seen;
      queue.emplace(reach.along_long_edges ? common_edge_mm(s, i, j) : -(step += 1), j);
    }
  }
  return out;
}

Fit fit_of(const Surfels& s, const Indices& support, const Surface& start, double start_mm, int most) {
  FitOptions options;
  options.cone = start.type == PrimitiveType::cone;
  options.start_mm = start_mm;
  options.max_surfels = most;
  return fit_round(s, support, start, options);
}

bool within(const Surface& s, const Limits& limits) {
  if (!(s.radius > 0) || s.radius > limits.max_radius_mm) return false;
  return s.type != PrimitiveType::torus || (s.minor_radius > 0 && s.minor_radius < s.radius);
}

/// Mean by area of how far the middles of the facets' edges lie off the surface.
double sagitta_of(const Surfels& s, const Indices& support, const Surface& surface) {
  double sum = 0, area = 0;
  for (std::uint32_t i : support) {
    Vec3 p[3];
    raw_points(s, i, p);
    double worst = 0;
    for (int k = 0; k < 3; ++k) worst = std::max(worst, std::abs(surface.distance(0.5 * (p[k] + p[(k + 1) % 3]))));
    sum += s.area_mm2[i] * worst;
    area += s.area_mm2[i];
  }
  return area > 0 ? sum / area : 0;
}

/// How many of the facets differ in direction from those next to them: coplanar triangles are one facet.
int turns_of(const Surfels& s, const Indices& support, int enough) {
  std::vector<Vec3f> seen;
  for (std::uint32_t i : support) {
    const bool known = std::any_of(seen.begin(), seen.end(), [&](const Vec3f& n) {
      return n.cross(s.normal[i]).norm() < 5e-3f && n.dot(s.normal[i]) > 0;
    });
    if (!known) seen.push_back(s.normal[i]);
    if (static_cast<int>(seen.size()) >= enough) break;
  }
  return static_cast<int>(seen.size());
}

/// How many corners the facets have.
std::size_t corners_of(const Surfels& s, const Indices& support) {
  Indices all;
  for (std::uint32_t i : support) all.insert(all.end(), s.mesh->triangles[i].begin(), s.mesh->triangles[i].end());
  std::sort(all.begin(), all.end());
  return static_cast<std::size_t>(std::unique(all.begin(), all.end()) - all.begin());
}

/// Share of the support's rim, by length, across which free facets go on turning as they do at the rim. A row of facets
/// cut out of a doubly curved surface lies on a cone as exactly as a cone does, but its neighbours turn by the same
/// angle again; those of a fillet turn by twice what they do where the fillet begins, for there the chord of its first
/// facet meets its tangent.
double goes_on_share(Scene& scene, const Indices& support) {
  const Surfels& s = scene.surfels;
  const std::uint32_t inside = ++scene.tick;
  for (std::uint32_t i : support) scene.mark[i] = inside;
  const auto outside = [&](std::uint32_t j) { return scene.free(j) && scene.mark[j] != inside; };
  const auto neighbours = [&](std::uint32_t i) {
    return std::span(s.neighbours).subspan(s.neighbour_begin[i], s.neighbour_begin[i + 1] - s.neighbour_begin[i]);
  };
  double rim = 0, on = 0;
  for (std::uint32_t i : support) {
    double shared = 0;
    for (std::uint32_t j : neighbours(i)) {
      const double length = common_edge_mm(s, i, j);
      if (scene.mark[j] == inside) {
        shared += length;
        continue;
      }
      if (!scene.free(j)) continue;
      const Vec3f turn = s.normal[j] - s.normal[i];
      const auto alike = [&](std::uint32_t from, std::uint32_t k) {
        const Vec3f next = s.normal[k] - s.normal[from];
        return next.dot(turn) > 0.8f * next.norm() * turn.norm() && next.norm() > 0.7f * turn.norm() &&
               next.norm() < 1.4f * turn.norm();
      };
      bool goes = false;
      for (std::uint32_t k : neighbours(j)) {
        if (!outside(k)) continue;
        goes = goes || alike(j, k);
        if ((s.normal[k] - s.normal[j]).norm() > 0.3f * turn.norm()) continue;
        for (std::uint32_t l : neighbours(k))  // over the other triangle of a quadrilateral
          goes = goes || (l != j && outside(l) && alike(j, l));
      }
      if (goes) on += length;
    }
    Vec3 p[3];
    raw_points(s, i, p);
    rim += (p[0] - p[1]).norm() + (p[1] - p[2]).norm() + (p[2] - p[0]).norm() - shared;
  }
  return rim > 0 ? on / rim : 0;
}

/// Tests of what has grown: it is held by its vertices, and it bends by more than they are off.
bool accepted(Scene& scene, Candidate& c, const Limits& limits) {
  const Surfels& s = scene.surfels;
  const Surface& surface = c.found.fit.surface;
  const Matrix6& covariance = c.found.fit.covariance;
  if (c.area < limits.min_area_mm2) return false;
  if (corners_of(s, c.found.support) < static_cast<std::size_t>(parameters_of(surface.type) + kProof)) return false;
  const double most = surface.type == PrimitiveType::cone ? kMostGoesOnCone : kMostGoesOn;
  if (goes_on_share(scene, c.found.support) > most) return false;
  if (std::sqrt(covariance(4, 4)) > 0.02 * surface.radius) return false;
  switch (surface.type) {
    case PrimitiveType::sphere:
      return turns_of(s, c.found.support, 6) >= 6 && !is_ring(s, c.found.support);
    case PrimitiveType::torus:
      return turns_of(s, c.found.support, 8) >= 8 && !is_ring(s, c.found.support) &&
             std::sqrt(covariance(5, 5)) < 0.05 * surface.minor_radius;
    default:
      break;
  }
  if (turns_of(s, c.found.support, kLeastTurns) < kLeastTurns) return false;
  if (std::sqrt(covariance(0, 0) + covariance(1, 1)) > 2.0 * kDegree) return false;
  if (surface.type == PrimitiveType::cone && (!tapers(c.found.fit) || std::abs(surface.half_angle) > 84 * kDegree))
    return false;
  c.found.arc = arc_of(s, c.found.support, surface);
  double sigma = 0;
  for (std::uint32_t i : c.found.support) sigma = std::max<double>(sigma, s.sigma_mm[i]);
  const double bulge =
      surface.radius * (1 - std::cos(std::min(0.5 * c.found.arc, 0.5 * kPi))) * std::cos(surface.half_angle);
  return c.found.arc > 15 * kDegree && bulge > 20 * sigma;
}

/// From the facets of a neighbourhood to all that lies on the surface near `start`.
Candidate settle(Scene& scene, const Indices& near, const Surface& start, const Limits& limits) {
  const Surfels& s = scene.surfels;
  Candidate c;
  if (!within(start, limits)) return {};
  const double size = start.type == PrimitiveType::torus ? start.minor_radius : start.radius;
  Fit fit = fit_of(s, near, start, 0.2 * size, 200);
  Indices support;
  for (int round = 0; round < kMostRounds; ++round) {
    if (!fit.valid || !within(fit.surface, limits)) return {};
    Indices next = grow(scene, fit.surface, near, 1.0, 0);
    if (next.size() < std::max<std::size_t>(kLeastTurns, near.size() / 4)) return {};
    const bool same = next.size() == support.size();
    support = std::move(next);
    if (same) break;
    fit = fit_of(s, support, fit.surface, 0, 400);
  }
  if (!fit.valid) return {};
  c.found.fit = fit;
  c.area = area_of(s, support);
  c.found.support = std::move(support);
  if (!accepted(scene, c, limits)) return {};
  c.sagitta = sagitta_of(s, c.found.support, fit.surface);
  return c;
}

/// The cone of a fan about the seed: few facets are enough, for its apex is exact.
Candidate settle_fan(Scene& scene, Indices fan, const Limits& limits) {
  const Surfels& s = scene.surfels;
  Candidate c;
  for (int round = 0; round < 3; ++round) {
    c.found.fit.surface = cone_from_fan(s, fan);
    if (!within(c.found.fit.surface, limits)) return {};
    c.found.support = grow(scene, c.found.fit.surface, fan, 1.0, 0);
    if (c.found.support.size() <= fan.size()) break;
    fan = c.found.support;  // where it goes on beyond the fan, the next round has none, and all is said by distances
  }
  c.area = area_of(s, c.found.support);
  if (!accepted(scene, c, limits)) return {};
  c.sagitta = sagitta_of(s, c.found.support, c.found.fit.surface);
  return c;
}

/// Of candidates in the order of their parameters: the one with most area; the first that explains as much, unless its
/// facets' edges bulge far more: two circles of vertices lie on a cone and on a ball.
void keep_better(Candidate&& next, Candidate& best) {
  if (next.area <= 0) return;
  const bool more = next.area * kSame > best.area;
  const bool as_much = next.area > kSame * best.area && next.sagitta < 0.5 * best.sagitta;
  if (best.area <= 0 || more || as_much) best = std::move(next);
}

/// Free facets about a corner of the seed.
Indices fan_about(Scene& scene, std::uint32_t seed, std::uint32_t corner) {
  const Surfels& s = scene.surfels;
  const std::uint32_t seen = ++scene.tick;
  Indices out(1, seed);
  scene.mark[seed] = seen;
  for (std::size_t at = 0; at < out.size(); ++at)
    for (std::uint32_t k = s.neighbour_begin[out[at]]; k < s.neighbour_begin[out[at] + 1]; ++k) {
      const std::uint32_t j = s.neighbours[k];
      const auto& t = s.mesh->triangles[j];
      if (scene.mark[j] == seen || !scene.free(j) || std::find(t.begin(), t.end(), corner) == t.end()) continue;
      scene.mark[j] = seen;
      out.push_back(j);
    }
  return out;
}

bool explains(Scene& scene, const Candidate& c, const Indices& near) {
  const std::uint32_t inside = ++scene.tick;
  for (std::uint32_t i : c.found.support) scene.mark[i] = inside;
  return std::all_of(near.begin(), near.end(), [&](std::uint32_t i) { return scene.mark[i] == inside; });
}

Candidate best_from(Scene& scene, std::uint32_t seed, const Limits& limits) {
  constexpr std::size_t kLeastFan = 8;  // corners elsewhere have about six facets
  Candidate best;
  for (std::uint32_t corner : scene.surfels.mesh->triangles[seed]) {
    Indices fan = fan_about(scene, seed, corner);
    if (fan.size() >= kLeastFan) keep_better(settle_fan(scene, std::move(fan), limits), best);
  }
  for (const Reach& reach : kReaches) {
    const Indices near = around(scene, seed, reach);
    if (near.size() < 4) break;
    if (explains(scene, best, near)) continue;
    for (const Surface& start : starts_on_mesh(scene.surfels, near)) {
      keep_better(settle(scene, near, start, limits), best);
      // The types come in the order of their parameters: what so few proposed and so many bear out needs no richer one.
      if (best.found.support.size() > 4 * near.size() && explains(scene, best, near)) return best;
    }
    if (near.size() < reach.facets) break;
  }
  return best;
}

/// Facets of what hangs together with enough free area to be a primitive, the largest first.
Indices seeds_of(Scene& scene, const Limits& limits) {
  const Surfels& s = scene.surfels;
  Indices free, out;
  for (std::uint32_t i = 0; i < s.size(); ++i)
    if (scene.free(i) && s.neighbour_begin[i] < s.neighbour_begin[i + 1]) free.push_back(i);
  for (const Indices& component : components(scene, free, kLeastTurns))
    if (area_of(s, component) >= limits.min_area_mm2) out.insert(out.end(), component.begin(), component.end());
  std::sort(out.begin(), out.end(), [&](std::uint32_t a, std::uint32_t b) {
    return s.area_mm2[a] != s.area_mm2[b] ? s.area_mm2[a] > s.area_mm2[b] : a < b;
  });
  return out;
}

/// Forgets that the facets about what was taken since `before` were looked at: they have other neighbourhoods now.
void look_again(Scene& scene, const std::vector<FoundSurface>& found, std::size_t before,
                std::vector<std::uint8_t>& looked_at) {
  constexpr int kRings = 5;  // as far as the largest neighbourhood reaches
  const Surfels& s = scene.surfels;
  Indices front;
  for (std::size_t f = before; f < found.size(); ++f)
    front.insert(front.end(), found[f].support.begin(), found[f].support.end());
  const std::uint32_t seen = ++scene.tick;
  for (int ring = 0; ring < kRings; ++ring) {
    Indices next;
    for (std::uint32_t i : front)
      for (std::uint32_t k = s.neighbour_begin[i]; k < s.neighbour_begin[i + 1]; ++k) {
        const std::uint32_t j = s.neighbours[k];
        if (!scene.free(j) || scene.mark[j] == seen) continue;
        scene.mark[j] = seen;
        looked_at[j] = 0;
        next.push_back(j);
      }
    front = std::move(next);
  }
}

/// Looks at the seeds, those next to each other as one, and takes what they find, of a batch the largest first.
bool take_round(Scene& scene, const Indices& seeds, const Limits& limits, std::vector<std::uint8_t>& looked_at,
                std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  const std::size_t before = found.size();
  std::size_t in_vain = 0;
  for (std::size_t at = 0; at < seeds.size() && in_vain < kMostInVain;) {
    Indices batch;
    for (; at < seeds.size() && batch.size() < kBatch; ++at) {
      if (looked_at[seeds[at]] || !scene.free(seeds[at])) continue;
      batch.push_back(seeds[at]);
      for (std::uint32_t j : around(scene, seeds[at], kReaches[0])) looked_at[j] = 1;
    }
    std::vector<Candidate> candidates(batch.size());
    parallel_each(static_cast<int>(batch.size()), [&](int k) {
      Scene own = scene.fork();
      candidates[static_cast<std::size_t>(k)] = best_from(own, batch[static_cast<std::size_t>(k)], limits);
    });
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.area > b.area; });
    in_vain += batch.size();
    for (Candidate& c : candidates) {
      if (c.area <= 0) break;
      in_vain = 0;
      std::erase_if(c.found.support, [&](std::uint32_t i) { return !scene.free(i); });
      if (area_of(s, c.found.support) >= kSame * c.area) take(scene, found, std::move(c.found));
    }
  }
  look_again(scene, found, before, looked_at);
  return found.size() > before;
}

}  // namespace

void find_round_on_mesh(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found) {
  // What lies between surfaces shows when they are taken.
  constexpr int kPasses = 8;
  std::vector<std::uint8_t> looked_at(scene.surfels.size(), 0);
  for (int pass = 0; pass < kPasses; ++pass)
    if (!take_round(scene, seeds_of(scene, limits), limits, looked_at, found)) break;
}

}  // namespace tribin::segmentation_detail
