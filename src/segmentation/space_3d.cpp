#include <algorithm>
#include <cmath>

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kShortArc = 60.0 * kDegree;  // below, a free radius means little: algorithms.md section 10
// Share of the rim that goes on smoothly: cylinders of the development scans 0-0.28, patches of a plaster bust
// 0.35-0.8.
constexpr double kMaxSmoothRim = 0.30;
constexpr double kClosedArc = 330.0 * kDegree;  // less a slot
constexpr double kSurfelsPerSigma = 28;         // pieces of the bust that end at edges: below 25; cylinders: above 28

std::size_t kept(const Scene& scene, const Indices& component, const FoundSurface& c) {
  std::size_t count = 0;
  for (std::uint32_t i : component) count += fits(scene.surfels, i, c.fit.surface, c.fit.scale, kRoundSlack);
  return count;
}

/// Fit, grow, fit: from a component to all that lies on its surface. Few surfels find the place, more the shape.
std::optional<FoundSurface> settle(Scene& scene, const Indices& component, const Surface& start, FitOptions options,
                                   const Limits& limits) {
  FoundSurface c;
  options.max_surfels = 200;
  c.fit = fit_round(scene.surfels, component, start, options);
  if (!c.fit.valid || c.fit.surface.radius > limits.max_radius_mm) return std::nullopt;
  // What is to be accepted keeps half of its component: one that keeps no third by now is not worth the rest.
  if (3 * kept(scene, component, c) < component.size()) return std::nullopt;
  options.start_mm = 0;
  for (int most : {300, 800}) {
    if (!c.fit.valid || c.fit.surface.radius > limits.max_radius_mm) return std::nullopt;
    c.support = grow(scene, c.fit.surface, component, c.fit.scale, kRoundSlack);
    if (c.support.size() < limits.min_surfels) return std::nullopt;
    options.max_surfels = most;
    c.fit = fit_round(scene.surfels, c.support, c.fit.surface, options);
  }
  if (!c.fit.valid) return std::nullopt;
  return c;
}

/// Sum of squared residuals of a component in sigmas, each capped where a fit gives up on it.
double capped_chi2(const Surfels& s, const Indices& component, const Surface& surface, double cap) {
  double sum = 0;
  for (std::uint32_t i : component) {
    const double e = std::min(std::abs(misfit(s, i, surface)) / s.sigma_mm[i], cap);
    sum += e * e;
  }
  return sum;
}

/// The nominal radius that explains the component best: each that the free fit leaves possible is tried on a sample,
/// the best is fitted in full.
std::optional<FoundSurface> explain_by_nominal(Scene& scene, const Indices& component, const FoundSurface* free_fit,
                                               const Surface& rough, const Limits& limits) {
  const Surfels& s = scene.surfels;
  const Surface& near = free_fit ? free_fit->fit.surface : rough;
  double reach = 0.2 * near.radius;
  if (free_fit) {
    // Where the free fit lies on the data like noise, its covariance says which radii are possible; else it may be a
    // compromise.
    const double sigmas = 5.0 * std::sqrt(free_fit->fit.covariance(4, 4));
    const bool clean = free_fit->fit.rms_sigma < 1.5 && 10 * kept(scene, component, *free_fit) > 9 * component.size();
    reach = clean ? sigmas + 0.02 * near.radius : std::max(sigmas, reach);
  }
  Vec3 mean = Vec3::Zero();
  for (std::uint32_t i : component) mean += s.normal[i].cast<double>();
  mean -= near.axis * near.axis.dot(mean);
  // The surface stays, the axis moves: along the mean normal.
  const Vec3 inwards = mean.normalized() * (near.concave ? -1.0 : 1.0);
  FitOptions held;
  held.hold_radius = true;
  held.start_mm = std::min(2.5, 0.15 * near.radius);
  held.max_surfels = 200;
  Surface best;
  double best_chi2 = 1e300;
  for (double radius : limits.radii_mm) {
    if (std::abs(radius - near.radius) > reach) continue;
    Surface start = near;
    start.point += inwards * (start.radius - radius);
    start.radius = radius;
    const Fit fit = fit_round(s, component, start, held);
    if (!fit.valid) continue;
    const double chi2 = capped_chi2(s, component, fit.surface, 4.0);
    if (chi2 < best_chi2) best_chi2 = chi2, best = fit.surface;
  }
  if (best_chi2 == 1e300) return std::nullopt;
  std::optional<FoundSurface> out = settle(scene, component, best, held, limits);
  if (out) out->radius_from_cad = true;
  return out;
}

/// Share of the support that touches what is explained already.
double flanked_share(const Scene& scene, const Indices& support) {
  const Surfels& s = scene.surfels;
  std::size_t count = 0;
  for (std::uint32_t i : support)
    count += std::any_of(s.neighbours.begin() + s.neighbour_begin[i], s.neighbours.begin() + s.neighbour_begin[i + 1],
                         [&](std::uint32_t j) { return !scene.free(j); });
  return static_cast<double>(count) / static_cast<double>(support.size());
}

/// Tests that every surface of revolution must pass before it explains anything.
bool accepted(Scene& scene, const Indices& component, const FoundSurface& c, double arc, const Limits& limits) {
  const Surfels& s = scene.surfels;
  if (area_of(s, c.support) < limits.min_area_mm2) return false;
  if (c.fit.rms_sigma > kMaxRmsSigma) return false;
  // Most of what voted must lie on it; else it is a compromise between surfaces.
  // Two equal surfaces may share a component: then the fit is as good as noise lets it be.
  const std::size_t on_it = kept(scene, component, c);
  if ((c.fit.rms_sigma > 2 ? 2 : 4) * on_it < component.size()) return false;
  // The axis must be held by the data.
  if (std::sqrt(c.fit.covariance(0, 0) + c.fit.covariance(1, 1)) > 5.0 * kDegree) return false;
  // Clearly not a plane: the sagitta over the arc exceeds the residuals.
  const double half = std::min(0.5 * arc, 0.5 * kPi);
  const double sagitta = c.fit.surface.radius * (1 - std::cos(half));
  double sigma = 0;
  for (std::uint32_t i : c.support) sigma += s.sigma_mm[i];
  sigma *= c.fit.scale / static_cast<double>(c.support.size());
  if (arc < 15 * kDegree || sagitta < 6.0 * sigma) return false;
  // Where two planes meet, the windows of the quadrics round the edge off: a strip of two or three cells along both.
  if (arc * c.fit.surface.radius < 4.0 * scene.cell_mm && flanked_share(scene, c.support) > 0.5) return false;
  // A piece cut out of a free-form surface: goes on smoothly past its rim, or leaves waves inside.
  const double rim = smooth_rim_share(scene, c.support);
  const double waves = residual_correlation(scene, c.support, c.fit.surface);
  // Closed around its axis it is no piece of anything: a shaft between two fillets goes on smoothly at either end.
  const bool closed = arc > kClosedArc;
  if (!closed && (rim > kMaxSmoothRim || (rim > 0.2 && waves > 0.5))) return false;
  // The rougher it lies, the more of it must be seen: curls of hair and lettering pass every other test.
  if (static_cast<double>(c.support.size()) < kSurfelsPerSigma * c.fit.rms_sigma) return false;
  return true;
}

/// Tests for spheres and tori, which have no arc about an axis that says how much of them is seen.
bool accepted_all_round(Scene& scene, const Indices& component, const FoundSurface& c, const Limits& limits) {
  const Surface& surface = c.fit.surface;
  if (area_of(scene.surfels, c.support) < limits.min_area_mm2 || c.fit.rms_sigma > kMaxRmsSigma) return false;
  if (2 * kept(scene, component, c) < component.size()) return false;
  if (smooth_rim_share(scene, c.support) > kMaxSmoothRim) return false;
  if (static_cast<double>(c.support.size()) < kSurfelsPerSigma * c.fit.rms_sigma) return false;
  if (std::sqrt(c.fit.covariance(4, 4)) > 0.1 * surface.radius) return false;
  if (surface.type != PrimitiveType::torus) return true;
  // Seven parameters follow any doubly curved patch: its residuals must be noise.
  return std::sqrt(c.fit.covariance(5, 5)) < 0.1 * surface.minor_radius &&
         residual_correlation(scene, c.support, surface) < 0.3;
}

/// The surface near `start` that explains most of a component, if it passes all tests.
std::optional<FoundSurface> explain_from(Scene& scene, const Indices& component, const Surface& start,
                                         const Limits& limits) {
  if (!(start.radius > 0) || start.radius > limits.max_radius_mm) return std::nullopt;
  const bool cone = start.type == PrimitiveType::cone;
  const double angle = std::abs(start.half_angle);
  if (cone && (angle < 3 * kDegree || angle > 80 * kDegree)) return std::nullopt;
  FitOptions options;
  options.start_mm = std::min(2.5, 0.15 * (start.type == PrimitiveType::torus ? start.minor_radius : start.radius));
  options.cone = cone;
  std::optional<FoundSurface> c = settle(scene, component, start, options, limits);
  if (!c || std::abs(c->fit.surface.half_angle) > 80 * kDegree) return std::nullopt;  // a dented plane
  if (cone && !tapers(c->fit)) return std::nullopt;                                   // find_cylinders' to take
  c->arc = arc_of(scene.surfels, c->support, c->fit.surface);
  const bool good =
      cone ? accepted(scene, component, *c, c->arc, limits) : accepted_all_round(scene, component, *c, limits);
  if (!good) return std::nullopt;
  return c;
}

/// Bayesian information criterion of a component: misfit and parameters, correlated data counted as what they say.
double bic_of(const Surfels& s, const Indices& component, const Fit& fit) {
  const double inflation = correlation_inflation(s), count = static_cast<double>(component.size()) / inflation;
  return capped_chi2(s, component, fit.surface, 4.0) / inflation +
         parameters_of(fit.surface.type) * std::log(std::max(2.0, count));
}

}  // namespace

void polish(const Scene& scene, FoundSurface& c) {
  FitOptions options;
  options.hold_radius = c.radius_from_cad;
  options.cone = c.fit.surface.type == PrimitiveType::cone;
  if (scene.surfels.scan == nullptr) {
    const Fit full = fit_round(scene.surfels, c.support, c.fit.surface, options);
    if (full.valid) c.fit = full;
    return;
  }
  Fit fine = c.fit;
  if (!refine_on_pixels(scene.surfels, c.support, options, scene.label, fine)) return;
  if (options.cone && !tapers(fine)) {  // what the cells took for a taper the pixels do not bear out
    options.cone = false;
    fine.surface.type = PrimitiveType::cylinder;
    fine.surface.half_angle = 0;
    if (!refine_on_pixels(scene.surfels, c.support, options, scene.label, fine)) return;
  }
  if (std::abs(fine.surface.radius - c.fit.surface.radius) > 0.1 * c.fit.surface.radius) return;
  c.fit = fine;
}

bool tapers(const Fit& cone) {
  return std::abs(cone.surface.half_angle) > std::max(5.0 * std::sqrt(cone.covariance(5, 5)), 0.7 * kDegree);
}

double arc_of(const Surfels& s, const Indices& support, const Surface& surface) {
  Vec3 u, v;
  orthonormal_basis(surface.axis, u, v);
  std::vector<double> angles;
  angles.reserve(support.size());
  for (std::uint32_t i : support) {
    Vec3 raw[3];
    const int count = raw_points(s, i, raw);
    for (int k = 0; k < count; ++k) {
      const Vec3 q = raw[k] - surface.point;
      angles.push_back(std::atan2(q.dot(v), q.dot(u)));
    }
  }
  std::sort(angles.begin(), angles.end());
  double gap = angles.front() + 2 * kPi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  // On a mesh the largest step between facets' corners is no gap.
  if (s.mesh != nullptr && gap < 40 * kDegree) return 2 * kPi;
  return 2 * kPi - gap;
}

std::optional<FoundSurface> explain_round(Scene& scene, const Indices& component, const Vec3& axis,
                                          const Limits& limits) {
  const Surfels& s = scene.surfels;
  const Surface rough = cylinder_from_normals(s, component, axis);
  if (!(rough.radius > 0) || rough.radius > 2 * limits.max_radius_mm) return std::nullopt;

  FitOptions free;
  free.start_mm = std::min(2.5, 0.15 * rough.radius);  // a step of 3 mm must not be bridged by the kernel
  std::optional<FoundSurface> best = settle(scene, component, rough, free, limits);
  if (!best || arc_of(s, best->support, best->fit.surface) < kShortArc) {
    std::optional<FoundSurface> nominal = explain_by_nominal(scene, component, best ? &*best : nullptr, rough, limits);
    // A nominal radius replaces the free one unless it loses surfels.
    if (nominal && (!best || kept(scene, component, *nominal) * 100 >= kept(scene, component, *best) * 97))
      best = std::move(nominal);
  }
  if (!best) return std::nullopt;

  // Taper by positions: a cone must not be called a cylinder.
  FitOptions taper;
  taper.cone = true;
  taper.max_surfels = 800;
  if (!best->radius_from_cad) {
    Fit cone = fit_round(s, best->support, best->fit.surface, taper);
    if (cone.valid && tapers(cone) && cone.rms_sigma < 0.8 * best->fit.rms_sigma) {
      FoundSurface c;
      c.fit = cone;
      c.support = grow(scene, cone.surface, best->support, cone.scale, kRoundSlack);
      if (c.support.size() >= limits.min_surfels) {
        c.fit = fit_round(s, c.support, cone.surface, taper);
        // A piece gave the first estimate; the better one reaches all around.
        if (c.fit.valid) c.support = grow(scene, c.fit.surface, c.support, c.fit.scale, kRoundSlack);
        if (c.support.size() >= limits.min_surfels) c.fit = fit_round(s, c.support, c.fit.surface, taper);
        if (c.support.size() >= limits.min_surfels && c.fit.valid && tapers(c.fit)) best = std::move(c);
      }
    }
  }
  const double arc = arc_of(s, best->support, best->fit.surface);
  if (!accepted(scene, component, *best, arc, limits)) return std::nullopt;
  best->arc = arc;
  return best;
}

void find_cones_and_spheres(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found) {
  const Surfels& s = scene.surfels;
  const std::size_t least = std::max<std::size_t>(6, limits.min_surfels / 2);
  for (SurfelShape shape : {SurfelShape::ruled, SurfelShape::curved}) {
    Indices members;
    for (std::uint32_t i = 0; i < s.size(); ++i)
      if (scene.free(i) && s.shape[i] == shape) members.push_back(i);
    for (Indices& component : components(scene, members, least)) {
      std::erase_if(component, [&](std::uint32_t i) { return !scene.free(i); });
      if (component.size() < least) continue;
      std::vector<Surface> starts;
      if (shape == SurfelShape::ruled) starts.push_back(cone_from_normals(s, component));
      if (shape == SurfelShape::curved) starts.push_back(sphere_from_normals(s, component));
      starts.push_back(torus_from_curvature(s, component));  // rulings are those of a bend where it is wide
      std::optional<FoundSurface> best;
      double best_bic = 1e300;
      for (const Surface& start : starts) {
        std::optional<FoundSurface> c = explain_from(scene, component, start, limits);
        if (!c) continue;
        const double bic = bic_of(s, component, c->fit);
        if (bic < best_bic) best_bic = bic, best = std::move(c);
      }
      if (best) take(scene, found, std::move(*best));
    }
  }
}

}  // namespace tribin::segmentation_detail
