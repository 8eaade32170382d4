#include "segmentation/fitting.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tribin::segmentation_detail {
namespace {

constexpr int kParameters = 6;
constexpr double kMadToSigma = 1.4826;  // of a normal distribution
using Square = Eigen::Matrix<double, kParameters, kParameters>;
using Column = Eigen::Matrix<double, kParameters, 1>;

/// Parameters in the order of Primitive::covariance: tilt u, tilt v, shift u, shift v, radius, half angle;
/// sphere: centre in 0-2, radius in 4.
struct Row {
  double residual;
  Column jacobian;
};

/// \param c, sn  cosine and sine of the half angle.
Row linearise(const Surface& s, const Vec3& u, const Vec3& v, double c, double sn, const Vec3& p) {
  Row row{0, Column::Zero()};
  const Vec3 q = p - s.point;
  if (s.type == PrimitiveType::sphere) {
    const double r = q.norm();
    row.residual = r - s.radius;
    row.jacobian.head<3>() = -q / std::max(r, 1e-9);
    row.jacobian[4] = -1;
    return row;
  }
  const double t = s.axis.dot(q);
  const Vec3 across = q - s.axis * t;
  const double r = across.norm();
  const Vec3 e = across / std::max(r, 1e-9);
  const double eu = e.dot(u), ev = e.dot(v);
  row.residual = (r - s.radius) * c - t * sn;
  // A tilt w moves the axis by w x a: about u by -v, about v by +u. The distance from the axis changes by -t (e . da),
  // the place along it by (across . da).
  row.jacobian[0] = t * ev * c + r * ev * sn;
  row.jacobian[1] = -t * eu * c - r * eu * sn;
  row.jacobian[2] = -eu * c;
  row.jacobian[3] = -ev * c;
  row.jacobian[4] = -c;
  row.jacobian[5] = -(r - s.radius) * sn - t * c;
  return row;
}

Surface stepped(const Surface& s, const Vec3& u, const Vec3& v, const Column& x) {
  Surface out = s;
  out.radius += x[4];
  if (s.type == PrimitiveType::sphere) {
    out.point += Vec3(x.head<3>());
    return out;
  }
  out.axis = (rotation_from_vector(u * x[0] + v * x[1]) * s.axis).normalized();
  out.point += u * x[2] + v * x[3];
  out.half_angle += x[5];
  return out;
}

/// Freezes the parameters that are held: unit rows and columns.
void hold(Square& h, Column& g, const Surface& s, const FitOptions& options) {
  const auto freeze = [&](int i) {
    h.row(i).setZero();
    h.col(i).setZero();
    h(i, i) = 1;
    g[i] = 0;
  };
  if (options.hold_radius) freeze(4);
  if (s.type == PrimitiveType::sphere) {
    freeze(3);
    freeze(5);
  } else if (!options.cone) {
    freeze(5);
  }
}

struct Sampled {
  std::vector<Vec3> points;
  std::vector<double> inverse_sigma;
};

Sampled sample(const Surfels& surfels, std::span<const std::uint32_t> support, int max_surfels) {
  Sampled out;
  const std::size_t stride = 1 + support.size() / static_cast<std::size_t>(std::max(1, max_surfels));
  out.points.reserve(support.size() / stride + 1);
  out.inverse_sigma.reserve(support.size() / stride + 1);
  Vec3 raw[3];
  for (std::size_t i = 0; i < support.size(); i += stride) {
    const int count = raw_points(surfels, support[i], raw);
    for (int k = 0; k < count; ++k) {
      out.points.push_back(raw[k]);
      out.inverse_sigma.push_back(1.0 / surfels.sigma_mm[support[i]]);
    }
  }
  return out;
}

/// Pixels of the support's cells, at most `most`, evenly strided; sd of a pixel along the surface's normal.
Sampled sample_pixels(const Surfels& s, std::span<const std::uint32_t> support, std::size_t most) {
  const Scan& scan = *s.scan;
  const int n = s.cell_px, columns = s.surfel_of_cell.width;
  const std::size_t total = support.size() * static_cast<std::size_t>(n) * n, stride = 1 + total / most;
  Sampled out;
  std::size_t k = 0;
  for (std::uint32_t i : support) {
    const int column = static_cast<int>(s.cell[i]) % columns, row = static_cast<int>(s.cell[i]) / columns;
    const double sigma_z = s.local_sigma_mm(std::min(column / 8, s.local_sigma_mm.width - 1),
                                            std::min(row / 8, s.local_sigma_mm.height - 1));
    const Vec3 center = s.position[i].cast<double>();
    const double facing = std::max(0.2, std::abs(s.normal[i].cast<double>().dot(center)) / center.z());
    for (int v = row * n; v < (row + 1) * n; ++v)
      for (int u = column * n; u < (column + 1) * n; ++u) {
        // A stride that shares a factor with the cell would always take the same corner: the row shifts it.
        if ((k++ + static_cast<std::size_t>(row)) % stride != 0 || !std::isfinite(scan.z_mm(u, v))) continue;
        out.points.push_back(scan.point(u, v));
        out.inverse_sigma.push_back(1.0 / (sigma_z * facing));
      }
  }
  return out;
}

/// Geman-McClure: residuals far beyond `mu` sigmas lose their say. Cost mu^2 e^2 / (mu^2 + e^2).
double robust_weight(double e, double mu) {
  const double k = mu * mu / (mu * mu + e * e);
  return k * k;
}

double cost_of(const Surface& s, const Sampled& data, double mu) {
  double cost = 0;
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    const double e = s.distance(data.points[i]) * data.inverse_sigma[i];
    cost += mu * mu * e * e / (mu * mu + e * e);
  }
  return cost;
}

double median_of(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// residual_scale() of the sample.
double scale_of(const Surface& s, const Sampled& data, double limit, std::vector<double>& scratch) {
  scratch.clear();
  const std::size_t stride = 1 + data.points.size() / 1000;  // a median of 1000 is good to 4 %
  for (std::size_t i = 0; i < data.points.size(); i += stride)
    scratch.push_back(std::abs(s.distance(data.points[i])) * data.inverse_sigma[i]);
  return std::clamp(kMadToSigma * median_of(scratch), 1.0, std::max(1.0, limit));
}

}  // namespace

double correlation_inflation(const Surfels& s) {
  if (s.scan == nullptr || s.correlation_px <= 0) return 1;
  const double n = s.cell_px, c2 = 4.0 * s.correlation_px * s.correlation_px;
  // Variance of a cell's mean by the separable sum of the correlation over the cell.
  double sum = 0;
  for (int d = -s.cell_px + 1; d < s.cell_px; ++d) sum += (n - std::abs(d)) * std::exp(-d * d / c2);
  const double mean_variance = sum * sum / (n * n * n * n);
  return std::max(1.0, kPi * c2 / (n * n) / mean_variance);
}

int raw_points(const Surfels& surfels, std::uint32_t i, Vec3 points[3]) {
  if (surfels.mesh == nullptr) {
    points[0] = surfels.position[i].cast<double>();
    return 1;
  }
  for (int k = 0; k < 3; ++k) points[k] = surfels.mesh->vertices[surfels.mesh->triangles[i][k]].cast<double>();
  return 3;
}

double misfit(const Surfels& surfels, std::uint32_t i, const Surface& surface) {
  Vec3 raw[3];
  const int count = raw_points(surfels, i, raw);
  double worst = 0;
  for (int k = 0; k < count; ++k) {
    const double d = surface.distance(raw[k]);
    if (std::abs(d) >= std::abs(worst)) worst = d;
  }
  return worst;
}

double residual_scale(const Surfels& surfels, std::span<const std::uint32_t> support, const Surface& surface) {
  std::vector<double> residuals;
  double points = 0;
  residuals.reserve(support.size());
  for (std::uint32_t i : support) {
    residuals.push_back(std::abs(misfit(surfels, i, surface)) / surfels.sigma_mm[i]);
    points += surfels.points[i];
  }
  if (residuals.empty()) return 1;
  const double limit = std::sqrt(points / static_cast<double>(residuals.size()));
  return std::clamp(kMadToSigma * median_of(residuals), 1.0, std::max(1.0, limit));
}

Fit fit_plane(const Surfels& surfels, std::span<const std::uint32_t> support) {
  Fit fit;
  if (support.size() < 3 && surfels.mesh == nullptr) return fit;
  Surface plane;
  double scale = 1;
  Matrix3 covariance = Matrix3::Zero();
  double total = 0;
  constexpr std::size_t kSample = 3000;  // surfels that iterate; the last round weighs all
  Indices some;
  if (support.size() > kSample) {
    const std::size_t stride = (support.size() + kSample - 1) / kSample;
    for (std::size_t i = 0; i < support.size(); i += stride) some.push_back(support[i]);
  }
  const std::span<const std::uint32_t> sample = some.empty() ? support : std::span<const std::uint32_t>(some);
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    Vec3 mean = Vec3::Zero(), facing = Vec3::Zero();
    Matrix3 second = Matrix3::Zero();
    total = 0;
    const Vec3 origin = round == 0 ? Vec3(surfels.position[support[0]].cast<double>()) : plane.point;
    Vec3 raw[3];
    for (std::uint32_t i : round + 1 < kRounds ? sample : support) {
      const int count = raw_points(surfels, i, raw);
      const double inverse = 1.0 / surfels.sigma_mm[i];
      for (int k = 0; k < count; ++k) {
        const Vec3 p = raw[k] - origin;
        double weight = inverse * inverse;
        if (round > 0) weight *= robust_weight(plane.distance(raw[k]) * inverse, 3.0 * scale);
        total += weight;
        mean += weight * p;
        second += weight * p * p.transpose();
        facing += weight * surfels.normal[i].cast<double>();
      }
    }
    if (!(total > 0)) return fit;
    mean /= total;
    covariance = second / total - mean * mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver{Eigen::Matrix3d(covariance)};
    plane.axis = solver.eigenvectors().col(0);
    if (plane.axis.dot(facing) < 0) plane.axis = -plane.axis;
    plane.point = mean + origin;
    scale = residual_scale(surfels, sample, plane);
  }
  Vec3 u, v;
  orthonormal_basis(plane.axis, u, v);
  double squares = 0;
  int inliers = 0;
  for (std::uint32_t i : sample) {
    const double e = misfit(surfels, i, plane) / surfels.sigma_mm[i];
    if (std::abs(e) > 4.0 * scale) continue;
    squares += e * e;
    ++inliers;
  }
  fit.rms_sigma = std::sqrt(squares / std::max(1, inliers));
  const double inflation = correlation_inflation(surfels) * std::max(1.0, fit.rms_sigma * fit.rms_sigma) / total;
  // Residual change: tilt about u lifts places along +v, tilt about v places along -u.
  Eigen::Matrix2d spread;
  spread << v.dot(covariance * v), -u.dot(covariance * v), -u.dot(covariance * v), u.dot(covariance * u);
  if (spread.determinant() < 1e-12) return fit;
  fit.covariance.topLeftCorner<2, 2>() = inflation * spread.inverse();
  fit.covariance(2, 2) = inflation;
  fit.surface = plane;
  fit.scale = scale;
  fit.valid = true;
  return fit;
}

double curvature_bound(const Surfels& surfels, std::span<const std::uint32_t> support, const Fit& plane) {
  Vec3 u, v;
  orthonormal_basis(plane.surface.axis, u, v);
  Square h = Square::Zero();
  Column g = Column::Zero();
  for (std::uint32_t i : support) {
    const Vec3 q = surfels.position[i].cast<double>() - plane.surface.point;
    const double x = q.dot(u), y = q.dot(v);
    const double weight = 1.0 / std::pow(surfels.sigma_mm[i] * plane.scale, 2);
    Column row;
    row << 1, x, y, 0.5 * x * x, x * y, 0.5 * y * y;
    h += weight * row * row.transpose();
    g += weight * row * plane.surface.axis.dot(q);
  }
  const Eigen::LDLT<Square> solver(h);
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() <= 0) return 1e30;
  const Column c = solver.solve(g);
  const Square covariance = correlation_inflation(surfels) * solver.solve(Square::Identity());
  const double middle = 0.5 * (c[3] + c[5]), half = std::sqrt(0.25 * (c[3] - c[5]) * (c[3] - c[5]) + c[4] * c[4]);
  return std::abs(middle) + half + 2.0 * std::sqrt(std::max(covariance(3, 3), covariance(5, 5)));
}

Fit fit_round(const Surfels& surfels, std::span<const std::uint32_t> support, const Surface& start,
              const FitOptions& options) {
  Fit fit;
  const bool raw = options.raw_pixels && surfels.scan != nullptr;
  const Sampled data = raw ? sample_pixels(surfels, support, static_cast<std::size_t>(options.max_surfels))
                           : sample(surfels, support, options.max_surfels);
  if (data.points.size() < kParameters) return fit;
  Surface s = start;
  if (options.cone) s.type = PrimitiveType::cone;

  const auto normal_equations = [&](const Surface& at, double mu, Square& h, Column& g) {
    Vec3 u, v;
    orthonormal_basis(at.axis, u, v);
    h.setZero();
    g.setZero();
    double cost = 0;
    const double c = std::cos(at.half_angle), sn = std::sin(at.half_angle);
    const int used = options.cone ? kParameters : kParameters - 1;
    for (std::size_t i = 0; i < data.points.size(); ++i) {
      const Row row = linearise(at, u, v, c, sn, data.points[i]);
      const double e = row.residual * data.inverse_sigma[i];
      const double weight = robust_weight(e, mu) * data.inverse_sigma[i] * data.inverse_sigma[i];
      for (int b = 0; b < used; ++b) {
        const double part = weight * row.jacobian[b];
        for (int a = b; a < used; ++a) h(a, b) += part * row.jacobian[a];  // columns lie together
      }
      g += weight * row.residual * row.jacobian;
      cost += mu * mu * e * e / (mu * mu + e * e);
    }
    h = Square(h.selfadjointView<Eigen::Lower>());
    hold(h, g, at, options);
    return cost;
  };

  // The kernel's width shrinks from `start_mm` to 3 sigmas of what the residuals are.
  std::vector<double> sigmas;
  for (double i : data.inverse_sigma) sigmas.push_back(1.0 / i);
  const double sigma = median_of(sigmas);
  double points = 0;
  for (std::uint32_t i : support) points += surfels.points[i];
  // Pixels scatter by their sigma; means may wave by as much.
  const double scale_limit = raw ? 2.0 : std::sqrt(points / static_cast<double>(support.size()));
  std::vector<double> scratch;
  double mu = std::max(3.0 * scale_of(s, data, scale_limit, scratch), options.start_mm / sigma);
  double lambda = 1e-4;
  Square h;
  Column g;
  constexpr int kMaxIterations = 40;
  for (int iteration = 0, settled = 0; iteration < kMaxIterations && settled < 2; ++iteration) {
    const double cost = normal_equations(s, mu, h, g);
    bool improved = false;
    double step = 0;
    for (int attempt = 0; attempt < 6 && !improved; ++attempt) {
      Square damped = h;
      damped.diagonal() *= 1.0 + lambda;
      const Column x = -damped.ldlt().solve(g);
      if (!x.allFinite()) return fit;
      Vec3 u, v;
      orthonormal_basis(s.axis, u, v);
      const Surface next = stepped(s, u, v, x);
      if (next.radius > 0 && std::abs(next.half_angle) < 85 * kDegree && cost_of(next, data, mu) <= cost) {
        s = next;
        lambda = std::max(1e-7, lambda * 0.1);
        improved = true;
        step = std::sqrt(std::max(0.0, -x.dot(g)));  // the step's length in standard deviations
      } else {
        lambda *= 10;
      }
    }
    const double target = 3.0 * scale_of(s, data, scale_limit, scratch);
    const bool shrinking = mu > 1.05 * target;
    if (shrinking) mu = std::max(target, 0.5 * mu);
    settled = !shrinking && (!improved || step < 0.02) ? settled + 1 : 0;
    if (!improved) lambda = 1e-4;
  }

  // Refer the axis to the middle of the data, where tilt and shift are least correlated.
  if (s.type != PrimitiveType::sphere) {
    double low = 1e300, high = -1e300;
    for (const Vec3& p : data.points) {
      const double t = s.axis.dot(p - s.point);
      low = std::min(low, t);
      high = std::max(high, t);
    }
    const double middle = 0.5 * (low + high);
    s.point += s.axis * middle;
    s.radius += middle * std::tan(s.half_angle);
  }
  if (!(s.radius > 0)) return fit;
  fit.scale = raw ? scale_of(s, data, scale_limit, scratch) : residual_scale(surfels, support, s);
  normal_equations(s, 3.0 * fit.scale, h, g);
  double squares = 0;
  int inliers = 0;
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    const double e = s.distance(data.points[i]) * data.inverse_sigma[i];
    if (std::abs(e) > 4.0 * fit.scale) continue;
    squares += e * e;
    ++inliers;
  }
  fit.rms_sigma = std::sqrt(squares / std::max(1, inliers));
  const Eigen::LDLT<Square> solver(h);
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() <= 0) return fit;
  Square covariance = solver.solve(Square::Identity());
  // Correlated noise averages down less than the number of data says; a sparse sample is less correlated.
  const double all = raw ? points : static_cast<double>(support.size());
  const double share = std::min(1.0, static_cast<double>(data.points.size()) / all);
  const double correlation =
      raw ? 4.0 * kPi * surfels.correlation_px * surfels.correlation_px : correlation_inflation(surfels);
  covariance *= std::max(1.0, correlation * share) * std::max(1.0, fit.rms_sigma * fit.rms_sigma);
  const auto clear = [&](int i) {
    covariance.row(i).setZero();
    covariance.col(i).setZero();
  };
  if (options.hold_radius) clear(4);
  if (s.type == PrimitiveType::sphere) clear(3);
  if (s.type == PrimitiveType::sphere || !options.cone) clear(5);
  fit.covariance = covariance;
  fit.surface = s;
  fit.valid = true;
  return fit;
}

Surface cylinder_from_normals(const Surfels& surfels, std::span<const std::uint32_t> support, const Vec3& axis) {
  Vec3 u, v;
  orthonormal_basis(axis, u, v);
  const Vec3 origin = surfels.position[support[0]].cast<double>();
  Eigen::Matrix2d a = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  std::vector<Eigen::Vector4d> lines;  // place and unit normal across the axis
  lines.reserve(support.size());
  for (std::uint32_t i : support) {
    const Vec3 p = surfels.position[i].cast<double>() - origin, n = surfels.normal[i].cast<double>();
    const Eigen::Vector2d place(p.dot(u), p.dot(v)), direction = Eigen::Vector2d(n.dot(u), n.dot(v)).normalized();
    const Eigen::Matrix2d across = Eigen::Matrix2d::Identity() - direction * direction.transpose();
    a += across;
    b += across * place;
    lines.emplace_back(place.x(), place.y(), direction.x(), direction.y());
  }
  Surface s;
  s.type = PrimitiveType::cylinder;
  s.axis = axis;
  if (a.determinant() < 1e-8 * a.trace() * a.trace()) return s;  // all normals are parallel
  const Eigen::Vector2d c = a.ldlt().solve(b);
  double along = 0;
  for (const Eigen::Vector4d& l : lines) along += l.tail<2>().dot(l.head<2>() - c);
  along /= static_cast<double>(lines.size());
  s.concave = along < 0;
  s.radius = std::abs(along);
  s.point = origin + u * c.x() + v * c.y();
  return s;
}

Surface sphere_from_normals(const Surfels& surfels, std::span<const std::uint32_t> support) {
  const Vec3 origin = surfels.position[support[0]].cast<double>();
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::uint32_t i : support) {
    const Eigen::Vector3d p = surfels.position[i].cast<double>() - origin, n = surfels.normal[i].cast<double>();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - n * n.transpose();
    a += across;
    b += across * p;
  }
  Surface s;
  s.type = PrimitiveType::sphere;
  if (a.determinant() < 1e-10 * std::pow(a.trace(), 3)) return s;
  const Eigen::Vector3d c = a.ldlt().solve(b);
  double along = 0;
  for (std::uint32_t i : support)
    along += surfels.normal[i].cast<double>().dot(surfels.position[i].cast<double>() - origin - Vec3(c));
  along /= static_cast<double>(support.size());
  s.concave = along < 0;
  s.radius = std::abs(along);
  s.point = origin + Vec3(c);
  return s;
}

Surface cone_from_normals(const Surfels& surfels, std::span<const std::uint32_t> support) {
  const Vec3 origin = surfels.position[support[0]].cast<double>();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero(), a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero(), center = Eigen::Vector3d::Zero();
  for (std::uint32_t i : support) {
    const Eigen::Vector3d p = surfels.position[i].cast<double>() - origin, n = surfels.normal[i].cast<double>();
    mean += n;
    center += p;
    second += n * n.transpose();
    a += n * n.transpose();
    b += n * n.dot(p);
  }
  const double count = static_cast<double>(support.size());
  mean /= count;
  center /= count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(second / count - mean * mean.transpose());
  Surface s;
  s.type = PrimitiveType::cone;
  s.axis = solver.eigenvectors().col(0);
  const double d = s.axis.dot(Vec3(mean));
  if (std::abs(d) > 0.99 || a.determinant() < 1e-10 * std::pow(a.trace(), 3)) return s;
  const Vec3 apex = Vec3(a.ldlt().solve(b));
  // Radius grows along +axis when outward normals lean back (d < 0).
  s.half_angle = -std::asin(d);
  const double t = s.axis.dot(Vec3(center) - apex);
  s.radius = t * std::tan(s.half_angle);
  if (s.radius < 0) {  // seen from inside: the normals point at the axis
    s.half_angle = -s.half_angle;
    s.radius = -s.radius;
    s.concave = true;
  }
  s.point = origin + apex + s.axis * t;
  return s;
}

}  // namespace tribin::segmentation_detail
