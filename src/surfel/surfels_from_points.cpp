#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "surfel/point_graph.hpp"
#include "surfel/point_window.hpp"
#include "surfel/shape.hpp"
#include "surfel/thin_points.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {
namespace {

using namespace surfel_detail;

constexpr std::size_t kMostSurfels = 200000;  // seconds on two cores; beyond, points are joined to means
constexpr std::size_t kNeighbours = 8;        // as a cell of a scan has
// Sizes of the windows, by sqrt(2): each halves the variance of the slope, and of the curvature by 2.8.
constexpr std::size_t kWindows[] = {34, 48, 68, 96, 136, 192};
constexpr std::size_t kStored = 24;  // the smallest: neighbours kept of each point; more are asked for where needed
// Sampling hides what is smaller than this share of the distance between points: coordinates rounded by a CAD system
// or a file are better than that, and no surface is told from its tangent at that height.
constexpr double kSamplingShare = 0.002;
constexpr double kTightBend = 0.05;            // spacings: residual of a quadric on a circle of two spacings' radius
constexpr double kSureNormal = 1.0 * kDegree;  // below the slack with which segmentation compares normals
constexpr double kSureCurvature = 10;          // sigmas of curvature: the ruling is then good to 3 deg

/// Square of area that a point has to itself, from the distance of its neighbours.
std::vector<float> areas_of(const std::vector<Vec3f>& points, const std::vector<std::vector<std::uint32_t>>& near) {
  std::vector<float> area(points.size(), 0.0f);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t k = std::min(kNeighbours, near[i].size() - 1);
    if (k > 0)
      area[i] = static_cast<float>(kPi * (points[near[i][k]] - points[i]).squaredNorm() / static_cast<double>(k));
  }
  return area;
}

double quantile(std::vector<float>& values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// sd of a point along its normal: a low quantile of the residuals of the smallest windows, in cubes as large as the
/// tiles of a scan; windows across edges are in the upper part.
/// \source as the local noise map of scans: algorithms.md section 15.
std::vector<float> local_sigma(const std::vector<Vec3f>& points, const std::vector<float>& area,
                               const std::vector<float>& residual) {
  constexpr double kShare = 0.3;
  constexpr double kQuantileOfChi = 0.88;      // of sqrt(chi2 / f) at 0.3 for the 18 degrees of freedom of 24 points
  constexpr double kTileSpacings = 8;          // as the tiles of 8 x 8 cells
  constexpr std::size_t kLeastResiduals = 30;  // a quantile of fewer is not known to a third
  std::vector<float> known, areas(area);
  for (float r : residual)
    if (r >= 0) known.push_back(r);
  const double typical = quantile(known, kShare) / kQuantileOfChi;
  const double tile = kTileSpacings * std::sqrt(quantile(areas, 0.5));
  std::map<std::array<int, 3>, std::vector<float>> tiles;
  const auto key = [&](const Vec3f& p) {
    std::array<int, 3> k;
    for (int axis = 0; axis < 3; ++axis)
      k[static_cast<std::size_t>(axis)] = static_cast<int>(std::floor((p[axis] - points[0][axis]) / tile));
    return k;
  };
  for (std::size_t i = 0; i < points.size(); ++i)
    if (residual[i] >= 0) tiles[key(points[i])].push_back(residual[i]);
  std::map<std::array<int, 3>, double> sigma;
  for (auto& [k, values] : tiles)
    sigma[k] = values.size() < kLeastResiduals ? typical : quantile(values, kShare) / kQuantileOfChi;
  std::vector<float> out(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = sigma.find(key(points[i]));
    out[i] =
        static_cast<float>(std::max(at == sigma.end() ? typical : at->second, kSamplingShare * std::sqrt(area[i])));
  }
  return out;
}

/// Residual that noise alone exceeds once in some thousand windows, in sigmas; 1.2 for the local sigma's own error.
double residual_limit(std::size_t points) {
  return 1.2 * (1 + 3.5 / std::sqrt(2.0 * (static_cast<double>(points) - 6)));
}

struct Judged {
  double sigma_curvature = 0, sigma_normal = 0;
  PointCurvature curvature;
};

Judged judge(const PointQuadric& q, double sigma) {
  Judged out;
  // The window's own residual where it is more: what the quadric does not follow.
  const double one = std::max(sigma, q.residual_mm);
  out.curvature = curvature_of(q);
  out.sigma_curvature = out.curvature.unit_sigma * one;
  const double a = q.variance_slope[0], b = q.variance_slope[1], c = q.variance_slope[2];
  out.sigma_normal = one * std::sqrt(0.5 * (a + c) + std::sqrt(0.25 * (a - c) * (a - c) + b * b));
  return out;
}

/// The smallest window that decides: its normal is sure, and so is whether it bends.
PointWindow grow_window(const PointTree& tree, const std::vector<Vec3f>& points, std::uint32_t i,
                        const PointWindow& smallest, double sigma, double spacing, double max_radius_mm) {
  const auto passes = [&](const PointWindow& w) {
    // What is left of the tightest radius that a window can follow counts as the surface's.
    const double noisy = residual_limit(static_cast<std::size_t>(w.quadric.points)) * sigma;
    return w.quadric.valid() && w.quadric.residual_mm <= std::hypot(noisy, kTightBend * spacing);
  };
  PointWindow best;
  if (!passes(smallest)) return best;
  best = smallest;
  std::vector<std::uint32_t> near;
  for (std::size_t size : kWindows) {
    const Judged judged = judge(best.quadric, sigma);
    const double bend = std::abs(judged.curvature.k1);
    const bool flat_or_not = best.bends && (bend > kSureCurvature * judged.sigma_curvature ||
                                            3.2 * judged.sigma_curvature < 0.7 / max_radius_mm);
    if (judged.sigma_normal < kSureNormal && flat_or_not) break;
    if (near.empty()) {
      tree.nearest(points[i], kWindows[std::size(kWindows) - 1], near);
      const auto self = std::find(near.begin(), near.end(), i);
      if (self != near.end()) std::rotate(near.begin(), self, self + 1);
    }
    if (near.size() < size) break;
    const PointWindow next = larger_window(points, std::span(near).first(size), best, sigma);
    if (!passes(next)) break;
    best = next;
  }
  return best;
}

/// The window that tells most of point i: its own, or that of a neighbour whose window holds it and on which it lies.
const PointWindow* window_for(std::size_t i, const std::vector<Vec3f>& points, const std::vector<std::uint32_t>& near,
                              const std::vector<PointWindow>& windows, double sigma) {
  if (windows[i].quadric.valid() && windows[i].bends) return &windows[i];
  const PointWindow* best = windows[i].quadric.valid() ? &windows[i] : nullptr;
  const Vec3 p = points[i].cast<double>();
  for (std::uint32_t j : near) {
    const PointQuadric& q = windows[j].quadric;
    if (!q.valid() || (p - q.origin).norm() > q.reach_mm) continue;
    if (std::abs(q.misfit(p)) > 4.0 * sigma) continue;
    if (best == nullptr || q.points > best->quadric.points) best = &windows[j];
  }
  return best;
}

void resize(Surfels& s, std::size_t count) {
  s.normal.assign(count, Vec3f::UnitZ());
  s.curvature1.assign(count, 0.0f);
  s.curvature2.assign(count, 0.0f);
  s.direction2.assign(count, Vec3f::UnitX());
  s.sigma_curvature.assign(count, 1.0f);  // 1/mm: nothing is known
  s.sigma_normal.assign(count, kUnknownNormal);
  s.shape.assign(count, SurfelShape::unknown);
}

/// Fills all but position, points and sources. \param sigma  per point; empty = estimated.
void fill(Surfels& s, std::vector<float> sigma, const std::optional<Vec3>& viewpoint) {
  const PointTree tree(s.position);
  const int count = static_cast<int>(s.size());
  constexpr int kGrain = 512;
  std::vector<std::vector<std::uint32_t>> near(s.size());
  std::vector<PointWindow> smallest(s.size()), windows(s.size());
  parallel_ranges(count, kGrain, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      tree.nearest(s.position[i], kStored, near[i]);
      // The point itself comes first, whatever lies in the same place.
      const auto self = std::find(near[i].begin(), near[i].end(), static_cast<std::uint32_t>(i));
      if (self != near[i].end()) std::rotate(near[i].begin(), self, self + 1);
    }
  });
  s.area_mm2 = areas_of(s.position, near);
  std::vector<float> residual(s.size(), -1.0f);
  parallel_ranges(count, kGrain, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      smallest[i] = smallest_window(s.position, near[i], std::sqrt(s.area_mm2[i]));
      if (smallest[i].bends) residual[i] = static_cast<float>(smallest[i].quadric.residual_mm);
    }
  });
  s.sigma_mm = sigma.empty() ? local_sigma(s.position, s.area_mm2, residual) : std::move(sigma);
  parallel_ranges(count, kGrain, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const PointWindow start = flat_or(smallest[i], s.position, near[i], s.sigma_mm[i]);
      windows[i] = grow_window(tree, s.position, static_cast<std::uint32_t>(i), start, s.sigma_mm[i],
                               std::sqrt(s.area_mm2[i]), s.max_radius_mm);
    }
  });
  resize(s, s.size());
  parallel_ranges(count, kGrain, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const PointWindow* window = window_for(i, s.position, near[i], windows, s.sigma_mm[i]);
      if (window == nullptr) continue;
      const Judged judged = judge(window->quadric, s.sigma_mm[i]);
      s.normal[i] = window->quadric.normal_at(s.position[i].cast<double>()).cast<float>();
      s.sigma_normal[i] = static_cast<float>(std::min(judged.sigma_normal, 0.5));  // below "unknown"
      s.direction2[i] = judged.curvature.direction2.cast<float>();
      if (!window->bends) continue;
      s.sigma_curvature[i] = static_cast<float>(judged.sigma_curvature);
      s.curvature1[i] = static_cast<float>(judged.curvature.k1);
      s.curvature2[i] = static_cast<float>(judged.curvature.k2);
      s.shape[i] = shape_of(judged.curvature.k1, judged.curvature.k2, judged.sigma_curvature, s.max_radius_mm);
    }
  });
  for (std::vector<std::uint32_t>& list : near) list.resize(std::min(list.size(), kNeighbours + 1));
  orient_normals(s, near, viewpoint);
  connect_points(s, near);
}

double diagonal(const std::vector<Vec3f>& points) {
  Vec3f low = points[0], high = points[0];
  for (const Vec3f& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  return (high - low).norm();
}

}  // namespace

Surfels surfels_from_points(const PointSet& set, const SurfelOptions& options) {
  constexpr std::size_t kLeast = 30;
  if (set.points.size() < kLeast)
    throw Error(ErrorCode::too_little_data, set.source + ": " + std::to_string(set.points.size()) +
                                                " points, at least " + std::to_string(kLeast) + " are needed");
  ThinPoints thin = thin_points(set.points, kMostSurfels);
  Surfels s;
  s.point_set = &set;
  s.oriented = set.viewpoint.has_value();
  s.position = std::move(thin.position);
  s.points = std::move(thin.points);
  s.surfel_of_point = std::move(thin.of_point);
  // No radius in a cloud matters that is larger than the cloud.
  s.max_radius_mm = std::min(options.max_radius_mm, static_cast<float>(diagonal(s.position)));
  if (!(s.max_radius_mm > 0)) throw Error(ErrorCode::too_little_data, set.source + ": all points lie in one place");
  fill(s, {}, set.viewpoint);
  return s;
}

Surfels surfels_among(const Surfels& all, std::span<const std::uint32_t> members) {
  TRIBIN_ASSERT(all.point_set != nullptr);
  Surfels s;
  s.point_set = all.point_set;
  s.oriented = all.oriented;
  s.max_radius_mm = all.max_radius_mm;
  std::vector<float> sigma;
  for (std::uint32_t i : members) {
    s.position.push_back(all.position[i]);
    s.points.push_back(all.points[i]);
    sigma.push_back(all.sigma_mm[i]);
  }
  fill(s, std::move(sigma), all.point_set->viewpoint);
  for (std::size_t k = 0; k < members.size(); ++k) s.area_mm2[k] = std::min(s.area_mm2[k], all.area_mm2[members[k]]);
  return s;
}

}  // namespace tribin
