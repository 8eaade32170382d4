#include "primitive_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace tribin {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr int kLeastPoints = 40;   // fewer say nothing of a surface
constexpr int kLeastPatches = 12;  // twice the numbers that a fit takes from them
constexpr double kArcBins = 72;

/// Distance of a point from the surface, outward positive, with its derivatives: by the point, and (negative) by the
/// parameters.
struct Residual {
  double distance = 0;
  Eigen::Vector3d normal;
  Vec6 jacobian = Vec6::Zero();
  double angle = 0;  ///< about the axis [rad]
  bool good = false;
};

Residual residual_of(const Primitive& p, const Eigen::Vector3d& x) {
  Residual out;
  const Eigen::Vector3d a = p.axis, d = x - Eigen::Vector3d(p.point);
  Vec3 u, v;
  orthonormal_basis(p.axis, u, v);
  if (p.type == PrimitiveType::plane) {
    out.distance = a.dot(d);
    out.normal = a;
    out.jacobian << -d.dot(Eigen::Vector3d(u)), -d.dot(Eigen::Vector3d(v)), 1, 0, 0, 0;
    out.good = true;
    return out;
  }
  if (p.type == PrimitiveType::sphere) {
    const double distance = d.norm();
    if (distance < 0.1 * p.radius_mm) return out;
    out.normal = d / distance;
    out.distance = distance - p.radius_mm;
    out.jacobian << out.normal, 0, 1, 0;
    out.good = true;
    return out;
  }
  const double along = a.dot(d);
  const Eigen::Vector3d across = d - a * along;
  const double rho = across.norm();
  // On the axis itself there is no direction to lean along.
  if (rho < 1e-6 || (p.type == PrimitiveType::cylinder && rho < 0.1 * p.radius_mm)) return out;
  const Eigen::Vector3d n = across / rho;
  const double nu = n.dot(Eigen::Vector3d(u)), nv = n.dot(Eigen::Vector3d(v));
  out.angle = std::atan2(nv, nu);
  out.good = true;
  if (p.type == PrimitiveType::cylinder) {
    out.distance = rho - p.radius_mm;
    out.normal = n;
    out.jacobian << along * nu, along * nv, nu, nv, 1, 0;
  } else {
    const double c = std::cos(p.half_angle), s = std::sin(p.half_angle), lever = c * along + s * rho;
    out.distance = c * rho - s * along;
    out.normal = n * c - a * s;
    out.jacobian << lever * nu, lever * nv, c * nu, c * nv, -s, lever;
  }
  return out;
}

/// The parameters that a primitive of this type has.
std::array<bool, 6> parameters_of(const Primitive& p, bool radius_free) {
  switch (p.type) {
    case PrimitiveType::plane:
      return {true, true, true, false, false, false};
    case PrimitiveType::sphere:
      return {true, true, true, false, radius_free, false};
    case PrimitiveType::cylinder:
      return {true, true, true, true, radius_free, false};
    default:
      return {true, true, true, true, true, true};
  }
}

struct Accepted {
  std::size_t index = 0;
  Residual residual;
  double sigma = 0;
};

std::vector<Accepted> accepted_points(const Primitive& surface, std::span<const SurfacePoint> points, double reach,
                                      double sigmas, double cad_sigma) {
  std::vector<Accepted> out;
  out.reserve(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const SurfacePoint& p = points[k];
    const Residual r = residual_of(surface, p.ray * p.z_mm);
    if (!r.good) continue;
    const double sigma = std::hypot(p.sigma_z_mm * r.normal.dot(p.ray), cad_sigma);
    if (std::abs(r.distance) <= sigmas * sigma + reach) out.push_back({k, r, sigma});
  }
  return out;
}

/// Robust sd of the residuals in sigmas, at least 1.
double spread_of(const std::vector<Accepted>& points) {
  std::vector<double> e;
  e.reserve(points.size());
  for (const Accepted& p : points) e.push_back(std::abs(p.residual.distance) / p.sigma);
  const auto middle = e.begin() + static_cast<std::ptrdiff_t>(e.size() / 2);
  std::nth_element(e.begin(), middle, e.end());
  return std::max(1.0, 1.4826 * *middle);
}

/// Seen arc about the axis: occupied bins of 5 deg.
double arc_of(const std::vector<Accepted>& points) {
  std::array<int, static_cast<std::size_t>(kArcBins)> bins{};
  for (const Accepted& p : points)
    ++bins[static_cast<std::size_t>((p.residual.angle + kPi) / (2 * kPi) * kArcBins) % bins.size()];
  // A bin counts that holds a fifth of its share: single points on a wrong surface show no arc.
  const double least = 0.2 * static_cast<double>(points.size()) / kArcBins;
  return static_cast<double>(std::count_if(bins.begin(), bins.end(), [&](int n) { return n > least; })) * 2 * kPi /
         kArcBins;
}

/// Sum over square patches of the pull of each at a fit that is at rest, and how many there are.
std::pair<Mat6, int> patch_pull(const std::vector<Accepted>& accepted, std::span<const SurfacePoint> points) {
  constexpr double kPatches = 25;
  const int side = std::max(4, static_cast<int>(std::lround(std::sqrt(double(accepted.size()) / kPatches))));
  std::map<std::pair<int, int>, Vec6> pulls;
  for (const Accepted& a : accepted) {
    const SurfacePoint& p = points[a.index];
    const auto at = pulls.try_emplace({p.j / side, p.i / side}, Vec6::Zero()).first;
    at->second += a.residual.jacobian * (a.residual.distance / (a.sigma * a.sigma));
  }
  Mat6 sum = Mat6::Zero();
  for (const auto& [key, pull] : pulls) sum += pull * pull.transpose();
  return {sum, static_cast<int>(pulls.size())};
}

}  // namespace

Primitive in_frame(const Primitive& primitive, const Pose& b_from_a) {
  Primitive out = primitive;
  out.axis = b_from_a.linear() * primitive.axis;
  out.point = b_from_a * primitive.point;
  out.offset_mm = out.axis.dot(out.point);
  return out;
}

Primitive nudged(const Primitive& primitive, int k, double h) {
  Primitive out = primitive;
  if (primitive.type == PrimitiveType::sphere) {
    if (k < 3) out.point[k] += h;
    if (k == 4) out.radius_mm += h;
    return out;
  }
  Vec3 u, v;
  orthonormal_basis(primitive.axis, u, v);
  if (k < 2) out.axis = (primitive.axis + h * (k == 0 ? u : v)).normalized();
  if (primitive.type == PrimitiveType::plane) {
    if (k == 2) out.point += h * primitive.axis;
  } else {
    if (k == 2) out.point += h * u;
    if (k == 3) out.point += h * v;
    if (k == 4 && primitive.type == PrimitiveType::cylinder) out.radius_mm += h;
    if (k == 4 && primitive.type == PrimitiveType::cone) out.point += h * primitive.axis;
    if (k == 5) out.half_angle += h;
  }
  out.offset_mm = out.axis.dot(out.point);
  return out;
}

double distance_from(const Primitive& surface, const Vec3& point) {
  const Residual r = residual_of(surface, point);
  return r.good ? r.distance : 0;
}

std::optional<FreeFit> fit_freely(const Primitive& nominal, std::span<const SurfacePoint> points,
                                  const FreeFitOptions& options) {
  if (nominal.type == PrimitiveType::torus) return {};
  std::vector<Accepted> accepted = accepted_points(nominal, points, options.reach_mm, 5, options.cad_sigma_mm);
  if (accepted.size() < kLeastPoints) return {};
  FreeFit out;
  Primitive& fit = out.measured;
  fit = nominal;
  const double arc = arc_of(accepted);
  const bool round = nominal.type == PrimitiveType::cylinder || nominal.type == PrimitiveType::cone;
  const std::array<bool, 6> has = parameters_of(nominal, !round || arc >= kLeastArc);
  // Tilts turn about the middle of what is seen, where they have nothing to do with the place.
  if (nominal.type == PrimitiveType::plane || nominal.type == PrimitiveType::cylinder) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Accepted& a : accepted) mean += points[a.index].ray * points[a.index].z_mm;
    mean /= static_cast<double>(accepted.size());
    const Eigen::Vector3d off = mean - Eigen::Vector3d(fit.point), axis = fit.axis;
    fit.point += nominal.type == PrimitiveType::plane ? Vec3(off - axis * axis.dot(off)) : Vec3(axis * axis.dot(off));
  }
  out.nominal = fit;
  // What the points do not hold stays near the nominal: within 3 deg, ten times a common angular tolerance, and within
  // the reach in which points are looked for.
  constexpr double kTiltPrior = 3 * kDegree;
  Vec6 prior = Vec6::Zero(), total = Vec6::Zero();
  for (int k = 0; k < 6; ++k) {
    const bool angle = nominal.type == PrimitiveType::sphere ? false : k < 2 || k == 5;
    const double sd = angle ? kTiltPrior : options.reach_mm;
    prior[k] = 1 / (sd * sd);
  }
  Mat6 information = Mat6::Identity();
  constexpr int kSteps = 8;  // the start is within a percent of the part: Gauss-Newton is done after three or four
  for (int it = 0; it <= kSteps; ++it) {
    Mat6 h = Mat6::Zero();
    Vec6 b = Vec6::Zero();
    for (const Accepted& a : accepted) {
      const double w = options.independent / (a.sigma * a.sigma);
      h += w * a.residual.jacobian * a.residual.jacobian.transpose();
      b += w * a.residual.jacobian * a.residual.distance;
    }
    h.diagonal() += prior;
    b -= prior.cwiseProduct(total);
    for (int k = 0; k < 6; ++k)
      if (!has[static_cast<std::size_t>(k)]) h.row(k).setZero(), h.col(k).setZero(), h(k, k) = 1, b[k] = 0;
    information = h;
    if (it == kSteps) break;
    const Vec6 step = h.ldlt().solve(b);
    for (int k = 0; k < 6; ++k) fit = nudged(fit, k, step[k]);
    total += step;
    // Points are chosen anew about the surface that was measured: what belongs to a neighbour goes.
    const double spread = spread_of(accepted);
    accepted = accepted_points(fit, points, 0, 3.5 * spread, options.cad_sigma_mm);
    if (accepted.size() < kLeastPoints) return {};
  }

  Mat6 inverse = information.ldlt().solve(Mat6::Identity());
  Eigen::Matrix<double, 6, kSystematicTerms> pull = Eigen::Matrix<double, 6, kSystematicTerms>::Zero();
  double squares = 0, squares_sigma = 0;
  out.held_by.assign(points.size(), false);
  for (const Accepted& a : accepted) {
    const SurfacePoint& p = points[a.index];
    out.held_by[a.index] = true;
    squares += a.residual.distance * a.residual.distance;
    squares_sigma += std::pow(a.residual.distance / a.sigma, 2);
    const double gain = options.independent * a.residual.normal.dot(p.ray) / (a.sigma * a.sigma);
    for (int t = 0; t < kSystematicTerms; ++t)
      pull.col(t) += a.residual.jacobian * (gain * p.terms[static_cast<std::size_t>(t)]);
  }
  const double count = static_cast<double>(accepted.size());
  for (int k = 0; k < 6; ++k)
    if (!has[static_cast<std::size_t>(k)]) pull.row(k).setZero(), inverse(k, k) = 0;
  out.response = inverse * pull;
  // Residuals beyond the noise count as noise; what patches have in common counts where it is more than that.
  const double inflation = std::max(1.0, squares_sigma / count);
  auto [common, patches] = patch_pull(accepted, points);
  out.patches = patches;
  Mat6 covariance = inverse * inflation;
  if (patches >= kLeastPatches) {
    common *= options.independent * options.independent * patches / (patches - 6.0) / (inflation * inflation);
    // In coordinates in which the noise's covariance is 1, no direction gets less.
    const Eigen::SelfAdjointEigenSolver<Mat6> noise(covariance);
    const Mat6 root = noise.eigenvectors() * noise.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Mat6> wide(Mat6(root.transpose() * common * root));
    covariance = root * wide.eigenvectors() * wide.eigenvalues().cwiseMax(1.0).asDiagonal() *
                 wide.eigenvectors().transpose() * root.transpose();
  }
  // The part is nowhere nearer to its CAD than the mesh is.
  const double cad = options.cad_sigma_mm * options.cad_sigma_mm;
  for (const int k : {2, 4})
    if (has[static_cast<std::size_t>(k)]) covariance(k, k) += cad;
  out.covariance = covariance;
  fit.arc = arc_of(accepted);
  fit.rms_mm = std::sqrt(squares / count);
  out.rms_sigma = std::sqrt(squares_sigma / count);
  fit.points = static_cast<int>(accepted.size());
  fit.radius_from_cad = round && nominal.type == PrimitiveType::cylinder && arc < kLeastArc;
  return out;
}

}  // namespace tribin
