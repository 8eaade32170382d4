#include "segmentation/fitting.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tribin::segmentation_detail {
namespace {

constexpr double kMadToSigma = 1.4826;  // of a normal distribution

/// Geman-McClure: residuals far beyond `mu` sigmas lose their say. Cost mu^2 e^2 / (mu^2 + e^2).
double robust_weight(double e, double mu) {
  const double k = mu * mu / (mu * mu + e * e);
  return k * k;
}

double median_of(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
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
  using Six = Eigen::Matrix<double, 6, 6>;
  using Row = Eigen::Matrix<double, 6, 1>;
  Vec3 u, v;
  orthonormal_basis(plane.surface.axis, u, v);
  Six h = Six::Zero();
  Row g = Row::Zero();
  for (std::uint32_t i : support) {
    const Vec3 q = surfels.position[i].cast<double>() - plane.surface.point;
    const double x = q.dot(u), y = q.dot(v);
    const double weight = 1.0 / std::pow(surfels.sigma_mm[i] * plane.scale, 2);
    Row row;
    row << 1, x, y, 0.5 * x * x, x * y, 0.5 * y * y;
    h += weight * row * row.transpose();
    g += weight * row * plane.surface.axis.dot(q);
  }
  const Eigen::LDLT<Six> solver(h);
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() <= 0) return 1e30;
  const Row c = solver.solve(g);
  const Six covariance = correlation_inflation(surfels) * solver.solve(Six::Identity());
  const double middle = 0.5 * (c[3] + c[5]), half = std::sqrt(0.25 * (c[3] - c[5]) * (c[3] - c[5]) + c[4] * c[4]);
  return std::abs(middle) + half + 2.0 * std::sqrt(std::max(covariance(3, 3), covariance(5, 5)));
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

Surface torus_from_curvature(const Surfels& surfels, std::span<const std::uint32_t> support) {
  std::vector<double> curvatures;
  for (std::uint32_t i : support) curvatures.push_back(surfels.curvature1[i]);
  const double curvature = median_of(curvatures);
  Surface s;
  s.type = PrimitiveType::torus;
  return curvature == 0 ? s : torus_of_tube(surfels, support, 1.0 / curvature);
}

Surface torus_of_tube(const Surfels& surfels, std::span<const std::uint32_t> support, double tube) {
  Surface s;
  s.type = PrimitiveType::torus;
  // The circle that the tube runs along: its plane, then its middle and radius by algebraic distances.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> spine;
  spine.reserve(support.size());
  for (std::uint32_t i : support) {
    spine.push_back(surfels.position[i].cast<double>() - tube * surfels.normal[i].cast<double>());
    mean += spine.back();
  }
  const double count = static_cast<double>(support.size());
  mean /= count;
  for (Eigen::Vector3d& p : spine) {
    p -= mean;
    second += p * p.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(second);
  const Eigen::Vector3d u = solver.eigenvectors().col(2), v = solver.eigenvectors().col(1);
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : spine) {
    const Eigen::Vector3d row(p.dot(u), p.dot(v), 1);
    a += row * row.transpose();
    b += row * row.head<2>().squaredNorm();
  }
  const Eigen::LDLT<Eigen::Matrix3d> fit(a);
  if (fit.info() != Eigen::Success || !(fit.vectorD().minCoeff() > 1e-9 * count)) return s;
  const Eigen::Vector3d c = fit.solve(b);
  const double square = c[2] + 0.25 * (c[0] * c[0] + c[1] * c[1]);
  if (!(square > 0)) return s;
  s.axis = solver.eigenvectors().col(0);
  if (s.axis.z() < 0) s.axis = -s.axis;
  s.point = Vec3(mean + 0.5 * (c[0] * u + c[1] * v));
  s.radius = std::sqrt(square);
  s.minor_radius = std::abs(tube);
  s.concave = tube < 0;
  if (s.minor_radius >= s.radius) s.radius = 0;  // would meet itself: a sphere or a cylinder is meant
  return s;
}

Surface surface_of(const Primitive& p) {
  Surface s;
  s.type = p.type;
  s.axis = p.axis;
  s.point = p.point;
  s.radius = p.radius_mm;
  s.minor_radius = p.minor_radius_mm;
  s.half_angle = p.half_angle;
  s.concave = p.concave;
  return s;
}

}  // namespace tribin::segmentation_detail
