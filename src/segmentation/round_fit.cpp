#include "segmentation/round_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "tribin/core/error.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr double kMadToSigma = 1.4826;  // of a normal distribution
constexpr double kWidth = 3.0;          // of the kernel in sigmas: 97 % of the information of clean data is kept

FitPoints sample(const Surfels& surfels, std::span<const std::uint32_t> support, int max_surfels) {
  FitPoints out;
  const std::size_t stride = 1 + support.size() / static_cast<std::size_t>(std::max(1, max_surfels));
  out.reserve(support.size() / stride + 1);
  if (surfels.mesh != nullptr) {  // a corner of six triangles is one point
    std::vector<std::pair<std::uint32_t, float>> corners;
    for (std::size_t i = 0; i < support.size(); i += stride)
      for (std::uint32_t v : surfels.mesh->triangles[support[i]]) corners.emplace_back(v, surfels.sigma_mm[support[i]]);
    std::sort(corners.begin(), corners.end());
    for (std::size_t k = 0; k < corners.size(); ++k)
      if (k == 0 || corners[k].first != corners[k - 1].first)
        out.add(surfels.mesh->vertices[corners[k].first].cast<double>(), 1.0 / corners[k].second);
    return out;
  }
  for (std::size_t i = 0; i < support.size(); i += stride)
    out.add(surfels.position[support[i]].cast<double>(), 1.0 / surfels.sigma_mm[support[i]]);
  return out;
}

/// Least cosine between ray and normal that a pixel's weight believes: beyond 80 deg sensors are worse than their
/// noise.
constexpr double kLeastFacing = 0.17;

/// Cells beside the support that no surface claims: where a body ends, its last pixels share their cell with others.
Indices rim_cells(const Surfels& s, std::span<const std::uint32_t> support, std::span<const std::int32_t> label) {
  const Image<std::int32_t>& cells = s.surfel_of_cell;
  Indices rim;
  for (std::uint32_t i : support) {
    const int column = static_cast<int>(s.cell[i]) % cells.width, row = static_cast<int>(s.cell[i]) / cells.width;
    for (int dv = -1; dv <= 1; ++dv)
      for (int du = -1; du <= 1; ++du) {
        if (!cells.contains(column + du, row + dv)) continue;
        const std::int32_t j = cells(column + du, row + dv);
        if (j < 0 || label[static_cast<std::size_t>(j)] == 0)
          rim.push_back(static_cast<std::uint32_t>((row + dv) * cells.width + column + du));
      }
  }
  std::sort(rim.begin(), rim.end());
  rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
  return rim;
}

/// Where a ray meets a surface of revolution or a sphere: of the two places the one nearest to the depth measured.
struct Meeting {
  double z = 0;
  double facing = 0;  ///< cosine between the ray of length 1 mm in z and the outward normal, signed; 0 = no meeting
};

Meeting meet(const Surface& f, const Vec3& ray, double measured) {
  // F = |across|^2 - (radius + k t)^2 (sphere: |q|^2 - radius^2) is a quadratic along the ray: a s^2 + 2 h s + c.
  double a, h, c, k = 0, dt = 0, ot = 0;
  if (f.type == PrimitiveType::sphere) {
    a = ray.squaredNorm();
    h = -ray.dot(f.point);
    c = f.point.squaredNorm() - f.radius * f.radius;
  } else {
    k = std::tan(f.half_angle);
    dt = f.axis.dot(ray);
    ot = -f.axis.dot(f.point);
    const Vec3 d = ray - f.axis * dt, o = -f.point - f.axis * ot;
    const double r = f.radius + k * ot;
    a = d.squaredNorm() - k * k * dt * dt;
    h = d.dot(o) - k * dt * r;
    c = o.squaredNorm() - r * r;
  }
  const double root = h * h - a * c;
  if (root <= 0 || a == 0) return {};
  const double half = std::sqrt(root), near = (-h - half) / a, far = (-h + half) / a;
  const bool first = std::abs(near - measured) < std::abs(far - measured);
  Meeting m;
  m.z = first ? near : far;
  const double rho = f.type == PrimitiveType::sphere ? f.radius : f.radius + k * (ot + m.z * dt);
  if (!(rho > 0)) return {};
  m.facing = (first ? -half : half) / (rho * std::sqrt(1 + k * k));
  return m;
}

/// Every `stride`-th pixel of the support's cells, and of the cells beside it those that lie on the surface. A scan
/// measures along its rays: the residual is that of z, in sigmas, and what the parameters change is taken where the ray
/// meets the surface. So neither depends on the noise in second order, which would bias tight radii.
struct RayData {
  FitPoints meetings;  ///< on the surface; inverse_sigma along its normal
  std::vector<double> residual;
};

RayData sample_rays(const Surfels& s, std::span<const std::uint32_t> support, const Indices& rim,
                    const Surface& surface, std::size_t stride) {
  const Scan& scan = *s.scan;
  const int n = s.cell_px, columns = s.surfel_of_cell.width;
  RayData out;
  const std::size_t expected = (support.size() + rim.size()) * static_cast<std::size_t>(n * n) / stride + 1;
  out.meetings.reserve(expected);
  out.residual.reserve(expected);
  std::size_t k = 0;
  const auto add_cell = [&](std::uint32_t cell, bool only_near) {
    const int column = static_cast<int>(cell) % columns, row = static_cast<int>(cell) / columns;
    const double sigma_z = s.local_sigma_mm(std::min(column / 8, s.local_sigma_mm.width - 1),
                                            std::min(row / 8, s.local_sigma_mm.height - 1));
    for (int v = row * n; v < (row + 1) * n; ++v)
      for (int u = column * n; u < (column + 1) * n; ++u) {
        // A stride that shares a factor with the cell would always take the same corner: the row shifts it.
        if ((k++ + static_cast<std::size_t>(row)) % stride != 0) continue;
        const double z = scan.z_mm(u, v);
        if (!std::isfinite(z)) continue;
        const Vec3 ray = scan.rays.empty() ? scan.camera.ray(u, v) : Vec3(scan.rays(u, v).cast<double>());
        const Meeting m = meet(surface, ray, z);
        if (std::abs(m.facing) < kLeastFacing || (only_near && std::abs(z - m.z) > 4.0 * sigma_z)) continue;
        out.meetings.add(ray * m.z, 1.0 / (sigma_z * std::abs(m.facing)));
        out.residual.push_back((m.facing > 0 ? z - m.z : m.z - z) / sigma_z);
      }
  };
  for (std::uint32_t i : support) add_cell(s.cell[i], false);
  for (std::uint32_t cell : rim) add_cell(cell, true);
  return out;
}

/// Robust size of residuals that are in sigmas: as residual_scale().
double scale_of(const std::vector<double>& residual, double limit, std::vector<double>& scratch) {
  scratch.clear();
  const std::size_t stride = 1 + residual.size() / 300;  // a median of 300 is good to 7 %: enough for a kernel's width
  for (std::size_t i = 0; i < residual.size(); i += stride) scratch.push_back(std::abs(residual[i]));
  if (scratch.empty()) return 1;
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::nth_element(scratch.begin(), middle, scratch.end());
  return std::clamp(kMadToSigma * *middle, 1.0, std::max(1.0, limit));
}

bool possible(const Surface& s) {
  if (s.type == PrimitiveType::torus && !(s.minor_radius > 0 && s.minor_radius < s.radius)) return false;
  return s.radius > 0 && std::abs(s.half_angle) < 85 * kDegree;
}

/// rms of the residuals within 4 `scale`, in sigmas.
double rms_of(const std::vector<double>& residual, double scale) {
  double squares = 0;
  std::size_t inliers = 0;
  for (double e : residual) {
    if (std::abs(e) > 4.0 * scale) continue;
    squares += e * e;
    ++inliers;
  }
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, inliers)));
}

/// Covariance of what was fitted. \param inflation  data per datum that is independent. \return whether there is one.
bool covariance_of(const NormalEquations& equations, const std::vector<int>& active, const FitOptions& options,
                   double inflation, Matrix6& out) {
  const Eigen::LDLT<Square> solver(equations.h);
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() <= 0) return false;
  const Square covariance = inflation * solver.solve(Square::Identity());
  const auto held = [&](int i) { return (options.hold_radius && i == 4) || (options.hold_axis && i < 2); };
  out.setZero();
  for (int a : active)
    for (int b : active)
      if (a < 6 && b < 6 && !held(a) && !held(b)) out(a, b) = covariance(a, b);
  return true;
}

}  // namespace

Fit fit_round(const Surfels& surfels, std::span<const std::uint32_t> support, const Surface& start,
              const FitOptions& options) {
  Fit fit;
  const FitPoints data = sample(surfels, support, options.max_surfels);
  if (data.size() < kParameters) return fit;
  Surface s = start;
  if (options.cone) s.type = PrimitiveType::cone;
  Linearised at, trial;
  linearise(s, data, at);

  // The kernel's width shrinks from `start_mm` to 3 sigmas of what the residuals are.
  std::vector<double> scratch(data.inverse_sigma);
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::nth_element(scratch.begin(), middle, scratch.end());
  const double inverse_sigma = *middle;
  double points = 0;
  for (std::uint32_t i : support) points += surfels.points[i];
  const double scale_limit = std::sqrt(points / static_cast<double>(support.size()));  // means may wave as pixels do
  double mu = std::max(kWidth * scale_of(at.residual, scale_limit, scratch), options.start_mm * inverse_sigma);
  double lambda = 1e-4;
  constexpr int kMaxIterations = 40;
  for (int iteration = 0, settled = 0; iteration < kMaxIterations && settled < 2; ++iteration) {
    NormalEquations equations = weigh(at, mu);
    hold(equations, at.active, options);
    const double cost = robust_cost(at.residual, mu);
    bool improved = false;
    double step = 0;
    for (int attempt = 0; attempt < 6 && !improved; ++attempt) {
      Square damped = equations.h;
      damped.diagonal() *= 1.0 + lambda;
      const Column x = -damped.ldlt().solve(equations.g);
      if (!x.allFinite()) return fit;
      const Surface next = stepped(s, x);
      if (possible(next)) linearise(next, data, trial);
      if (possible(next) && robust_cost(trial.residual, mu) <= cost) {
        s = next;
        std::swap(at, trial);
        lambda = std::max(1e-7, lambda * 0.1);
        improved = true;
        step = std::sqrt(std::max(0.0, -x.dot(equations.g)));  // the step's length in standard deviations
      } else {
        lambda *= 10;
      }
    }
    const double target = kWidth * scale_of(at.residual, scale_limit, scratch);
    const bool shrinking = mu > 1.05 * target;
    if (shrinking) mu = std::max(target, 0.5 * mu);
    settled = !shrinking && (!improved || step < 0.02) ? settled + 1 : 0;
    if (!improved) lambda = 1e-4;
  }

  // Refer the axis to the middle of the data, where tilt and shift are least correlated.
  if (s.type == PrimitiveType::cylinder || s.type == PrimitiveType::cone) {
    double low = 1e300, high = -1e300;
    for (std::size_t i = 0; i < data.size(); ++i) {
      const double t = s.axis.dot(Vec3(data.x[i], data.y[i], data.z[i]) - s.point);
      low = std::min(low, t);
      high = std::max(high, t);
    }
    const double along = 0.5 * (low + high);
    s.point += s.axis * along;
    s.radius += along * std::tan(s.half_angle);
    linearise(s, data, at);
  }
  if (!(s.radius > 0)) return fit;
  fit.scale = residual_scale(surfels, support, s);
  fit.rms_sigma = rms_of(at.residual, fit.scale);
  NormalEquations equations = weigh(at, kWidth * fit.scale);
  hold(equations, at.active, options);
  // Correlated noise averages down less than the number of data says; a sparse sample is less correlated.
  const double share = std::min(1.0, static_cast<double>(data.size()) / static_cast<double>(support.size()));
  const double inflation = std::max(1.0, correlation_inflation(surfels) * share);
  if (!covariance_of(equations, at.active, options, inflation * std::max(1.0, fit.rms_sigma * fit.rms_sigma),
                     fit.covariance))
    return fit;
  fit.surface = s;
  fit.valid = true;
  return fit;
}

bool refine_on_pixels(const Surfels& surfels, std::span<const std::uint32_t> support, const FitOptions& options,
                      std::span<const std::int32_t> label, Fit& fit) {
  TRIBIN_ASSERT(surfels.scan != nullptr);
  if (fit.surface.type == PrimitiveType::torus) return false;  // its rays are quartic
  // Under correlated noise a third of the pixels per independent one say all; a large support is good to more than the
  // sensor.
  constexpr double kMost = 60000, kLeast = 3000;
  double points = 0;
  for (std::uint32_t i : support) points += surfels.points[i];
  const double information = std::max(1.0, 4.0 * kPi * surfels.correlation_px * surfels.correlation_px);
  const double most = std::min(kMost, std::max(kLeast, 3.0 * points / information));
  const auto stride = static_cast<std::size_t>(std::max(1.0, std::ceil(points / most)));
  const Indices rim = rim_cells(surfels, support, label);
  Surface s = fit.surface;
  Linearised at;
  std::vector<double> scratch;
  double scale = 1;
  NormalEquations equations;
  // The cells' fit is within its error of the answer, so that one step of Newton lands; a long one is checked.
  constexpr double kLongStep = 5.0;  // standard deviations
  for (int round = 0; round < 3; ++round) {
    RayData data = sample_rays(surfels, support, rim, s, stride);
    if (data.residual.size() < kParameters) return false;
    linearise(s, data.meetings, at);
    std::swap(at.residual, data.residual);
    scale =
        scale_of(at.residual, 2.0, scratch);  // pixels scatter by their sigma; the waves below it are theirs as well
    equations = weigh(at, kWidth * scale);
    hold(equations, at.active, options);
    const Column x = -equations.h.ldlt().solve(equations.g);
    if (!x.allFinite()) return false;
    s = stepped(s, x);
    if (!possible(s)) return false;
    if (-x.dot(equations.g) < kLongStep * kLongStep * scale * scale) break;
  }
  const double rms = rms_of(at.residual, scale);
  const double share = std::min(1.0, static_cast<double>(at.residual.size()) / points);
  Matrix6 covariance;
  if (!covariance_of(equations, at.active, options, std::max(1.0, information * share) * std::max(1.0, rms * rms),
                     covariance))
    return false;
  fit.surface = s;
  fit.covariance = covariance;
  return true;
}

}  // namespace tribin::segmentation_detail
