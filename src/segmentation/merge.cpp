#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "segmentation/spaces.hpp"

namespace tribin::segmentation_detail {
namespace {

// A gate that saves joint fits, which decide: 99.9 % of 5 degrees of freedom is 20.5, at twice the sd, because where
// one piece was cut from the other depends on the noise.
constexpr double kChi2 = 4 * 20.5;
constexpr double kMaxTilt = 5 * kDegree;  // pieces whose axes are held to less are joined by nothing
constexpr double kSeenThrough = 0.15;     // share of a gap's rays that may end behind the surface: mixed pixels of rims

using Matrix7 = Eigen::Matrix<double, 7, 7>;

/// Covariance of a surface's axis as a rotation vector, of the axis' place at `at`, both in space, and of the radius.
Matrix7 axis_covariance(const Fit& fit, const Vec3& at) {
  Vec3 u, v;
  orthonormal_basis(fit.surface.axis, u, v);
  Eigen::Matrix<double, 7, 5> to_space = Eigen::Matrix<double, 7, 5>::Zero();
  const Vec3 along = fit.surface.axis * fit.surface.axis.dot(at - fit.surface.point);
  to_space.block<3, 1>(0, 0) = u;
  to_space.block<3, 1>(0, 1) = v;
  to_space.block<3, 1>(3, 0) = u.cross(along);
  to_space.block<3, 1>(3, 1) = v.cross(along);
  to_space.block<3, 1>(3, 2) = u;
  to_space.block<3, 1>(3, 3) = v;
  to_space(6, 4) = 1;
  return to_space * fit.covariance.topLeftCorner<5, 5>() * to_space.transpose();
}

/// Place of a surface's axis nearest to `at`.
Vec3 on_axis(const Surface& s, const Vec3& at) { return s.point + s.axis * s.axis.dot(at - s.point); }

constexpr double kMostWaves = 25;  // residuals of neighbours correlated by 0.67: beyond, the surface is another

/// How many times the variance of a mean grows where neighbouring residuals are correlated by r, as those of a sensor's
/// slow waves are: (1 + r) / (1 - r) along rows and along columns.
double wave_inflation(Scene& scene, const FoundSurface& f) {
  const double r = std::max(0.0, residual_correlation(scene, f.support, f.fit.surface));
  return std::min(std::pow((1 + r) / (1 - r), 2), kMostWaves);
}

/// Whether two cylinders' axes and radii are equal within their joint covariance, `waves` times what noise makes it.
bool same_cylinder(const Fit& a, const Fit& b, double waves) {
  const Surface &p = a.surface, &q = b.surface;
  const Vec3 middle = 0.5 * (p.point + q.point);
  const Matrix7 both = axis_covariance(a, middle) + axis_covariance(b, middle);
  Vec3 u, v;
  orthonormal_basis(p.axis, u, v);
  const Vec3 other = p.axis.dot(q.axis) > 0 ? q.axis : Vec3(-q.axis);
  const Vec3 turn = p.axis.cross(other), shift = on_axis(q, middle) - on_axis(p, middle);
  Eigen::Matrix<double, 5, 7> across = Eigen::Matrix<double, 5, 7>::Zero();
  across.block<1, 3>(0, 0) = u.transpose();
  across.block<1, 3>(1, 0) = v.transpose();
  across.block<1, 3>(2, 3) = u.transpose();
  across.block<1, 3>(3, 3) = v.transpose();
  across(4, 6) = 1;
  Eigen::Matrix<double, 5, 5> c = across * both * across.transpose();
  c.diagonal().array() += 1e-12;
  c(4, 4) += 1e-6;  // radii that were held at one nominal value have no variance
  Eigen::Matrix<double, 5, 1> d;
  d << u.dot(turn), v.dot(turn), u.dot(shift), v.dot(shift), q.radius - p.radius;
  return d.dot(c.ldlt().solve(d)) < kChi2 * waves;
}

bool same_sphere(const Fit& a, const Fit& b, double waves) {
  Eigen::Matrix4d c = Eigen::Matrix4d::Zero();
  for (const Fit* f : {&a, &b}) {
    c.topLeftCorner<3, 3>() += f->covariance.topLeftCorner<3, 3>();
    c(3, 3) += f->covariance(4, 4);
    for (int i = 0; i < 3; ++i) c(i, 3) = c(3, i) = c(i, 3) + f->covariance(i, 4);
  }
  c.diagonal().array() += 1e-6;
  Eigen::Vector4d d;
  d << Eigen::Vector3d(b.surface.point - a.surface.point), b.surface.radius - a.surface.radius;
  return d.dot(c.ldlt().solve(d)) < kChi2 * waves;
}

struct Extent {
  double low = 1e300, high = -1e300;
};

Extent extent_of(const Surfels& s, const Indices& support, const Surface& surface) {
  Extent e;
  for (std::uint32_t i : support) {
    const double t = surface.axis.dot(s.position[i].cast<double>() - surface.point);
    e.low = std::min(e.low, t);
    e.high = std::max(e.high, t);
  }
  return e;
}

/// Depth along a ray of unit length from the camera to the near side of a convex cylinder, the far side of a concave
/// one; < 0 where it misses.
double meet(const Surface& c, const Vec3& ray) {
  const Vec3 d = ray - c.axis * c.axis.dot(ray), o = c.axis * c.axis.dot(c.point) - c.point;
  const double a = d.squaredNorm(), b = d.dot(o), k = o.squaredNorm() - c.radius * c.radius;
  const double root = b * b - a * k;
  if (root < 0 || a <= 0) return -1;
  return (c.concave ? -b + std::sqrt(root) : -b - std::sqrt(root)) / a;
}

/// Whether the scan looks through the surface between the two pieces: something seen behind it says that it ends there.
bool seen_through(const Scene& scene, const Surface& joint, double scale, const Indices& a, const Indices& b) {
  const Surfels& s = scene.surfels;
  if (joint.type == PrimitiveType::sphere || joint.type == PrimitiveType::torus) return false;
  const Extent ea = extent_of(s, a, joint), eb = extent_of(s, b, joint);
  const double low = std::min(ea.high, eb.high), high = std::max(ea.low, eb.low);
  if (high - low < 3 * scene.cell_mm) return false;  // side by side: no room for an end
  // Without a camera nothing says that the gap is hidden; rays that meet a cone are not followed.
  if (s.scan == nullptr || joint.type == PrimitiveType::cone) return true;
  std::size_t hits = 0, behind = 0;
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    const Vec3 p = s.position[i].cast<double>();
    const double far = p.norm();
    const Vec3 ray = p / far;
    const double near = meet(joint, ray);
    if (near < 0) continue;
    const Vec3 at = ray * near;
    const double t = joint.axis.dot(at - joint.point);
    if (t < low + scene.cell_mm || t > high - scene.cell_mm) continue;
    ++hits;
    // At grazing incidence a small error of the surface is a large one along the ray.
    const double facing = std::abs(joint.normal(at).dot(ray));
    if (facing < 0.3) continue;
    behind += (far - near) * facing > 4.0 * scale * s.sigma_mm[i] + 0.1 * scene.cell_mm;
  }
  return static_cast<double>(behind) > kSeenThrough * static_cast<double>(hits);
}

/// Sum of squared residuals in sigmas, each capped where a fit gives up on it.
double chi2_of(const Surfels& s, const Indices& support, const Surface& surface, double scale) {
  double sum = 0;
  const double cap = 4.0 * scale;
  for (std::uint32_t i : support) sum += std::pow(std::min(std::abs(misfit(s, i, surface)) / s.sigma_mm[i], cap), 2);
  return sum;
}

/// Whether a surface leaves nothing but noise on a support: chi-square within 3 sd. Where noise cut one piece from
/// another, each was fitted to data chosen to agree with it, and two fits seem better than they are.
bool only_noise(const Surfels& s, const Indices& support, const Fit& fit, double scale) {
  const double count = static_cast<double>(support.size());
  return chi2_of(s, support, fit.surface, scale) <
         count * (1.0 + 3.0 * std::sqrt(2.0 * correlation_inflation(s) / count));
}

/// One surface of `type` in place of two, where it explains both as well as its fewer parameters ask.
std::optional<FoundSurface> joined(Scene& scene, const FoundSurface& a, const FoundSurface& b, PrimitiveType type,
                                   double waves) {
  const Surfels& s = scene.surfels;
  Indices both = a.support;
  both.insert(both.end(), b.support.begin(), b.support.end());
  FitOptions options;
  options.hold_radius = a.radius_from_cad && b.radius_from_cad;
  options.cone = type == PrimitiveType::cone;
  options.max_surfels = 1500;
  // Two strips that were taken for cylinders are far from their cone: its normals say where it is.
  const bool strips = type == PrimitiveType::cone && a.fit.surface.type != type;
  const Surface start = strips ? cone_from_normals(s, both) : a.fit.surface;
  if (!(start.radius > 0)) return std::nullopt;
  const Fit fit = fit_round(s, both, start, options);
  if (!fit.valid || fit.rms_sigma > kMaxRmsSigma) return std::nullopt;
  if (type == PrimitiveType::cone && !tapers(fit)) return std::nullopt;
  const double scale = std::max(a.fit.scale, b.fit.scale);
  const double apart = chi2_of(s, a.support, a.fit.surface, scale) + chi2_of(s, b.support, b.fit.surface, scale);
  const double together = chi2_of(s, both, fit.surface, scale);
  // Bayesian information criterion with correlated noise: the misfit that counts is in variances of what the two fits
  // leave, and correlated data are as many as their information says.
  const double count = static_cast<double>(both.size()), inflation = correlation_inflation(s) * waves;
  const double variance = std::max(1.0, apart / count) * inflation;
  const int saved = parameters_of(a.fit.surface.type) + parameters_of(b.fit.surface.type) - parameters_of(type);
  const bool simpler = (together - apart) / variance <= saved * std::log(std::max(2.0, count / inflation));
  if (!simpler && !(only_noise(s, a.support, fit, scale) && only_noise(s, b.support, fit, scale))) return std::nullopt;
  if (seen_through(scene, fit.surface, fit.scale, a.support, b.support)) return std::nullopt;
  FoundSurface out;
  out.fit = fit;
  out.support = std::move(both);
  out.radius_from_cad = options.hold_radius;
  out.peak = a.peak;
  return out;
}

/// Whether most of a support lies on a surface that was fitted without it.
bool mostly_on(const Surfels& s, const Indices& support, const Fit& fit) {
  constexpr std::size_t kSample = 64;
  const std::size_t stride = 1 + support.size() / kSample;
  std::size_t on = 0, count = 0;
  for (std::size_t i = 0; i < support.size(); i += stride, ++count)
    on += fits(s, support[i], fit.surface, 2.0 * fit.scale, kRoundSlack);
  return 2 * on > count;
}

/// Whether surfels of one support are neighbours of the other's.
bool touching(const Scene& scene, const Indices& a, const Indices& b) {
  if (a.empty() || b.empty()) return false;
  const Surfels& s = scene.surfels;
  const std::int32_t other = scene.label[a.front()];
  return std::any_of(b.begin(), b.end(), [&](std::uint32_t i) {
    return std::any_of(s.neighbours.begin() + s.neighbour_begin[i], s.neighbours.begin() + s.neighbour_begin[i + 1],
                       [&](std::uint32_t j) { return scene.label[j] == other; });
  });
}

/// What may replace two surfaces: one of the larger's kind, or a cone of which both are strips.
std::optional<FoundSurface> one_of(Scene& scene, const FoundSurface& large, const FoundSurface& small) {
  const Surface &p = large.fit.surface, &q = small.fit.surface;
  const bool alike = p.type == q.type && p.concave == q.concave;
  const auto same = [&](double waves) {
    if (!alike || std::abs(p.radius - q.radius) > 0.2 * std::max(p.radius, q.radius)) return false;
    if (p.type == PrimitiveType::sphere) return same_sphere(large.fit, small.fit, waves);
    if (p.type != PrimitiveType::cylinder || std::abs(p.axis.dot(q.axis)) < std::cos(kMaxTilt)) return false;
    return same_cylinder(large.fit, small.fit, waves);
  };
  // Strips of one cone may look like cylinders of their own: only a joint fit says.
  const auto axial = [](const Surface& f) {
    return f.type == PrimitiveType::cylinder || f.type == PrimitiveType::cone;
  };
  const bool strips = axial(p) && axial(q) && p.concave == q.concave && touching(scene, large.support, small.support);
  // Where even the slowest waves would not make them one, their waves need not be known.
  const bool covered = mostly_on(scene.surfels, small.support, large.fit);
  if (!covered && !strips && !same(kMostWaves)) return std::nullopt;
  const double waves = std::max(wave_inflation(scene, large), wave_inflation(scene, small));
  std::optional<FoundSurface> one;
  if (covered || same(waves)) one = joined(scene, large, small, p.type, waves);
  if (!one && strips) one = joined(scene, large, small, PrimitiveType::cone, waves);
  return one;
}

}  // namespace

void merge_pieces(Scene& scene, std::vector<FoundSurface>& found) {
  std::vector<std::size_t> order(found.size());
  for (std::size_t i = 0; i < found.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return found[a].support.size() > found[b].support.size(); });
  std::vector<bool> gone(found.size(), false);
  bool any = false;
  for (std::size_t a = 0; a < order.size(); ++a)
    for (std::size_t b = a + 1; b < order.size(); ++b) {
      const std::size_t i = order[a], j = order[b];
      if (gone[i]) break;
      if (gone[j] || found[i].fit.surface.type == PrimitiveType::plane) continue;
      std::optional<FoundSurface> one = one_of(scene, found[i], found[j]);
      if (!one) continue;
      // Grown anew: it may reach surfels between them that neither could reach alone.
      for (std::uint32_t k : one->support) scene.label[k] = 0;
      one->support = grow(scene, one->fit.surface, one->support, one->fit.scale, kRoundSlack);
      for (std::uint32_t k : one->support) scene.label[k] = static_cast<std::int32_t>(i + 1);
      one->arc = arc_of(scene.surfels, one->support, one->fit.surface);
      found[i] = std::move(*one);
      gone[j] = any = true;
      b = a;  // the larger piece may reach what the smaller did not
    }
  if (!any) return;
  std::vector<std::int32_t> id(found.size() + 1, 0);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (gone[i]) continue;
    id[i + 1] = static_cast<std::int32_t>(kept + 1);
    if (kept != i) found[kept] = std::move(found[i]);
    ++kept;
  }
  found.resize(kept);
  for (std::int32_t& label : scene.label) label = id[static_cast<std::size_t>(label)];
}

}  // namespace tribin::segmentation_detail
