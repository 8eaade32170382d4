#include "io/cloud_camera.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "tribin/core/parallel.hpp"

namespace tribin::io {
namespace {

constexpr int kTile = 64;  // rows; partial sums are joined in this order whatever the number of threads

/// Sums over the valid points of (1, u, v, x/z, y/z) times itself; u and v from the middle of the image.
using Moments = Eigen::Matrix<double, 5, 5>;

Moments moments_of(const Image<Vec3f>& points) {
  const int tiles = (points.height + kTile - 1) / kTile;
  std::vector<Moments, Eigen::aligned_allocator<Moments>> partial(tiles, Moments::Zero());
  const double middle_u = 0.5 * (points.width - 1), middle_v = 0.5 * (points.height - 1);
  parallel_ranges(points.height, kTile, [&](int begin, int end) {
    Moments& sum = partial[begin / kTile];
    for (int v = begin; v < end; ++v) {
      const Vec3f* row = points.row(v);
      double s = 0, su = 0, suu = 0, sx = 0, sy = 0, sux = 0, suy = 0, sxx = 0, syy = 0;  // v is constant in a row
      for (int u = 0; u < points.width; ++u) {
        const Vec3f& p = row[u];
        if (!(p.z() > 0) || !std::isfinite(p.x()) || !std::isfinite(p.y()) || !std::isfinite(p.z())) continue;
        const double x = static_cast<double>(p.x()) / p.z(), y = static_cast<double>(p.y()) / p.z(), du = u - middle_u;
        s += 1;
        su += du;
        suu += du * du;
        sx += x;
        sy += y;
        sux += du * x;
        suy += du * y;
        sxx += x * x;
        syy += y * y;
      }
      const double dv = v - middle_v;
      sum(0, 0) += s;
      sum(0, 1) += su;
      sum(0, 2) += s * dv;
      sum(0, 3) += sx;
      sum(0, 4) += sy;
      sum(1, 1) += suu;
      sum(1, 2) += su * dv;
      sum(1, 3) += sux;
      sum(1, 4) += suy;
      sum(2, 2) += s * dv * dv;
      sum(2, 3) += sx * dv;
      sum(2, 4) += sy * dv;
      sum(3, 3) += sxx;
      sum(4, 4) += syy;
    }
  });
  Moments total = Moments::Zero();
  for (const Moments& m : partial) total += m;
  return total;
}

/// value = slope * t + offset over the points, and the mean square that is left.
struct Line {
  double slope = 0, offset = 0, mean_square = 0;
};

Line regress(const Moments& m, int t, int value) {
  const double n = m(0, 0), mean_t = m(0, t) / n, mean_value = m(0, value) / n;
  const double stt = m(t, t) / n - mean_t * mean_t, svv = m(value, value) / n - mean_value * mean_value;
  const double stv = m(t, value) / n - mean_t * mean_value;
  Line line;
  if (stt < 0.25) return line;  // less than a pixel of spread: no slope to be had
  line.slope = stv / stt;
  line.offset = mean_value - line.slope * mean_t;
  line.mean_square = std::max(0.0, svv - line.slope * stv);
  return line;
}

}  // namespace

CameraFit fit_pinhole(const Image<Vec3f>& points) {
  CameraFit fit;
  fit.camera.width = points.width;
  fit.camera.height = points.height;
  const Moments m = moments_of(points);
  if (m(0, 0) < 6) return fit;
  Line x = regress(m, 1, 3), y = regress(m, 2, 4);
  const Line x_by_v = regress(m, 2, 3), y_by_u = regress(m, 1, 4);
  fit.transposed = x_by_v.mean_square < x.mean_square && y_by_u.mean_square < y.mean_square && x_by_v.slope != 0;
  if (fit.transposed) x = x_by_v, y = y_by_u;
  if (x.slope == 0 || y.slope == 0) return fit;
  PinholeCamera& c = fit.camera;
  if (fit.transposed) std::swap(c.width, c.height);
  c.fx = 1 / x.slope;
  c.fy = 1 / y.slope;
  c.cx = 0.5 * (c.width - 1) - x.offset * c.fx;
  c.cy = 0.5 * (c.height - 1) - y.offset * c.fy;
  fit.rms_px = std::sqrt(0.5 * (x.mean_square * c.fx * c.fx + y.mean_square * c.fy * c.fy));
  return fit;
}

namespace {

constexpr int kTerms = 21;  // of a polynomial of the fifth degree in two variables
using Terms = Eigen::Matrix<double, kTerms, 1>;

Terms terms_of(double u, double v) {
  Terms t;
  int n = 0;
  for (int degree = 0; degree <= 5; ++degree) {
    for (int k = 0; k <= degree; ++k) t(n++) = std::pow(u, degree - k) * std::pow(v, k);
  }
  return t;
}

bool valid(const Vec3f& p) { return p.allFinite() && p.z() > 0; }

/// Some thousands of points, evenly over the grid: enough for a smooth model, whatever the size of the image.
template <class Visit>
void visit_sample(const Image<Vec3f>& points, Visit visit) {
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(points.size()) / 20'000)));
  for (int v = 0; v < points.height; v += step) {
    for (int u = 0; u < points.width; u += step) {
      if (points(u, v).allFinite()) visit(u, v, points(u, v));
    }
  }
}

}  // namespace

LensFit fit_lens(const Image<Vec3f>& points, const PinholeCamera& pinhole) {
  LensFit fit;
  const double half_u = 0.5 * points.width, half_v = 0.5 * points.height;
  Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Eigen::Matrix<double, kTerms, 2> right = Eigen::Matrix<double, kTerms, 2>::Zero();
  int count = 0;
  visit_sample(points, [&](int u, int v, const Vec3f& p) {
    if (!valid(p)) return;
    const Terms t = terms_of(u / half_u - 1, v / half_v - 1);
    normal += t * t.transpose();
    right += t * Eigen::RowVector2d(p.x() / static_cast<double>(p.z()), p.y() / static_cast<double>(p.z()));
    ++count;
  });
  if (count < 10 * kTerms) return fit;
  const Eigen::Matrix<double, kTerms, 2> model = normal.ldlt().solve(right);
  double sum = 0;
  visit_sample(points, [&](int u, int v, const Vec3f& p) {
    if (!valid(p)) return;
    const Eigen::RowVector2d ray = terms_of(u / half_u - 1, v / half_v - 1).transpose() * model;
    sum += std::pow((p.x() / static_cast<double>(p.z()) - ray.x()) * pinhole.fx, 2) +
           std::pow((p.y() / static_cast<double>(p.z()) - ray.y()) * pinhole.fy, 2);
  });
  fit.rms_px = std::sqrt(0.5 * sum / count);
  fit.rays = Image<Vec3f>(points.width, points.height, Vec3f::Zero());
  parallel_ranges(points.height, kTile, [&](int begin, int end) {
    for (int v = begin; v < end; ++v) {
      for (int u = 0; u < points.width; ++u) {
        const Vec3f& p = points(u, v);
        if (valid(p)) {
          fit.rays(u, v) = Vec3f(p.x() / p.z(), p.y() / p.z(), 1);
        } else {
          const Eigen::RowVector2d ray = terms_of(u / half_u - 1, v / half_v - 1).transpose() * model;
          fit.rays(u, v) = Vec3f(static_cast<float>(ray.x()), static_cast<float>(ray.y()), 1);
        }
      }
    }
  });
  return fit;
}

std::optional<Pose> locate_camera(const Image<Vec3f>& points) {
  // Points and pixels are centred and scaled, else the system is ill conditioned.
  Vec3 mean = Vec3::Zero();
  double count = 0, spread = 0;
  visit_sample(points, [&](int, int, const Vec3f& p) { mean += p.cast<double>(), ++count; });
  if (count < 100) return {};
  mean /= count;
  visit_sample(points, [&](int, int, const Vec3f& p) { spread += (p.cast<double>() - mean).squaredNorm(); });
  const double scale = std::sqrt(spread / count), half = 0.5 * points.width;
  const double middle_u = 0.5 * (points.width - 1), middle_v = 0.5 * (points.height - 1);
  if (!(scale > 0)) return {};
  using Matrix12 = Eigen::Matrix<double, 12, 12>;
  Matrix12 system = Matrix12::Zero();
  visit_sample(points, [&](int u, int v, const Vec3f& p) {
    Eigen::Vector4d h;
    h << (p.cast<double>() - mean) / scale, 1;
    Eigen::Matrix<double, 12, 1> a = Eigen::Matrix<double, 12, 1>::Zero(), b = a;
    a.segment<4>(0) = h;
    a.segment<4>(8) = -(u - middle_u) / half * h;
    b.segment<4>(4) = h;
    b.segment<4>(8) = -(v - middle_v) / half * h;
    system += a * a.transpose() + b * b.transpose();
  });
  const Eigen::SelfAdjointEigenSolver<Matrix12> solver(system);
  // A plane, or an axis-parallel projection, leaves more than one solution.
  if (!(solver.eigenvalues()(1) > 1e-9 * solver.eigenvalues()(11))) return {};
  Eigen::Matrix<double, 3, 4> projection;
  for (int i = 0; i < 3; ++i) projection.row(i) = solver.eigenvectors().col(0).segment<4>(4 * i).transpose();
  Eigen::Matrix3d left = projection.leftCols<3>();
  if (left.row(2).norm() < 1e-6) return {};  // an orthographic grid: no centre
  const Eigen::Vector3d center = left.fullPivLu().solve(Eigen::Vector3d(-projection.col(3)));
  if (!center.allFinite()) return {};
  // RQ decomposition, row by row from below: forward, then down, then right. The mean of the points lies in front.
  Eigen::Vector3d forward = left.row(2).normalized();
  if (forward.dot(center) > 0) forward = -forward, left = -left;
  const Eigen::Vector3d down = (left.row(1).transpose() - left.row(1).dot(forward) * forward).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(0) = down.cross(forward);
  rotation.row(1) = down;
  rotation.row(2) = forward;
  Pose camera_from_file = Pose::Identity();
  camera_from_file.linear() = rotation;
  camera_from_file.translation() = -rotation * (center * scale + Eigen::Vector3d(mean));
  return camera_from_file;
}

}  // namespace tribin::io
