#include <algorithm>
#include <cmath>

#include "segmentation/round_fit.hpp"
#include "tribin/core/vector_levels.hpp"

namespace tribin::segmentation_detail {
namespace {

constexpr std::size_t kLanes = 4;  // partial sums of every dot product, whatever the processor's vectors hold

/// What the loops over points need of a surface, as plain numbers.
struct Numbers {
  double px, py, pz, ax, ay, az, ux, uy, uz, vx, vy, vz, radius, minor, c, s;
  explicit Numbers(const Surface& f)
      : radius(f.radius), minor(f.minor_radius), c(std::cos(f.half_angle)), s(std::sin(f.half_angle)) {
    Vec3 u, v;
    orthonormal_basis(f.axis, u, v);
    px = f.point.x(), py = f.point.y(), pz = f.point.z();
    ax = f.axis.x(), ay = f.axis.y(), az = f.axis.z();
    ux = u.x(), uy = u.y(), uz = u.z();
    vx = v.x(), vy = v.y(), vz = v.z();
  }
};

TRIBIN_VECTOR_LEVELS void sphere_rows(const Numbers& k, std::size_t n, const double* __restrict x,
                                      const double* __restrict y, const double* __restrict z,
                                      const double* __restrict w, double* __restrict residual, double* __restrict j0,
                                      double* __restrict j1, double* __restrict j2, double* __restrict j4) {
  const Numbers a = k;
  for (std::size_t i = 0; i < n; ++i) {
    const double qx = x[i] - a.px, qy = y[i] - a.py, qz = z[i] - a.pz;
    const double r = std::sqrt(qx * qx + qy * qy + qz * qz);
    const double scale = -w[i] / std::max(r, 1e-9);
    residual[i] = (r - a.radius) * w[i];
    j0[i] = qx * scale;
    j1[i] = qy * scale;
    j2[i] = qz * scale;
    j4[i] = -w[i];
  }
}

/// A tilt t moves the axis by t x a: about u by -v, about v by +u. The distance from the axis changes by -along (e.da),
/// the place along it by (across.da).
TRIBIN_VECTOR_LEVELS void axial_rows(const Numbers& k, std::size_t n, const double* __restrict x,
                                     const double* __restrict y, const double* __restrict z, const double* __restrict w,
                                     double* __restrict residual, double* __restrict j0, double* __restrict j1,
                                     double* __restrict j2, double* __restrict j3, double* __restrict j4,
                                     double* __restrict j5) {
  const Numbers a = k;
  for (std::size_t i = 0; i < n; ++i) {
    const double qx = x[i] - a.px, qy = y[i] - a.py, qz = z[i] - a.pz;
    const double t = a.ax * qx + a.ay * qy + a.az * qz;
    const double ru = a.ux * qx + a.uy * qy + a.uz * qz, rv = a.vx * qx + a.vy * qy + a.vz * qz;
    const double r = std::sqrt(ru * ru + rv * rv);
    const double inverse = 1.0 / std::max(r, 1e-9);
    const double eu = ru * inverse, ev = rv * inverse;
    const double weight = w[i], off = r - a.radius, lever = (t * a.c + r * a.s) * weight;
    residual[i] = (off * a.c - t * a.s) * weight;
    j0[i] = lever * ev;
    j1[i] = -lever * eu;
    j2[i] = -eu * a.c * weight;
    j3[i] = -ev * a.c * weight;
    j4[i] = -a.c * weight;
    j5[i] = -(off * a.s + t * a.c) * weight;
  }
}

/// As for a cone whose half angle is that of each point's place on the tube: the normal is (c e - s a) with
/// c = (r - radius) / l, s = -t / l, l the distance from the tube's circle.
TRIBIN_VECTOR_LEVELS void torus_rows(const Numbers& k, std::size_t n, const double* __restrict x,
                                     const double* __restrict y, const double* __restrict z, const double* __restrict w,
                                     double* __restrict residual, double* __restrict j0, double* __restrict j1,
                                     double* __restrict j2, double* __restrict j3, double* __restrict j4,
                                     double* __restrict j5, double* __restrict j6) {
  const Numbers a = k;
  for (std::size_t i = 0; i < n; ++i) {
    const double qx = x[i] - a.px, qy = y[i] - a.py, qz = z[i] - a.pz;
    const double t = a.ax * qx + a.ay * qy + a.az * qz;
    const double ru = a.ux * qx + a.uy * qy + a.uz * qz, rv = a.vx * qx + a.vy * qy + a.vz * qz;
    const double r = std::sqrt(ru * ru + rv * rv);
    const double inverse = 1.0 / std::max(r, 1e-9);
    const double eu = ru * inverse, ev = rv * inverse, weight = w[i];
    const double off = r - a.radius, l = std::sqrt(off * off + t * t);
    const double c = off / std::max(l, 1e-9), s = -t / std::max(l, 1e-9);
    const double lever = (t * c + r * s) * weight;
    residual[i] = (l - a.minor) * weight;
    j0[i] = lever * ev;
    j1[i] = -lever * eu;
    j2[i] = -eu * c * weight;
    j3[i] = -ev * c * weight;
    j4[i] = -c * weight;
    j5[i] = -weight;
    j6[i] = s * weight;
  }
}

/// Robust weights times the derivatives: sqrt of the weight on both sides of each product.
TRIBIN_VECTOR_LEVELS void root_weights(std::size_t n, const double* __restrict e, double mu2, double* __restrict out) {
  for (std::size_t i = 0; i < n; ++i) out[i] = mu2 / (mu2 + e[i] * e[i]);
}

TRIBIN_VECTOR_LEVELS void scaled(std::size_t n, const double* __restrict k, const double* __restrict a,
                                 double* __restrict out) {
  for (std::size_t i = 0; i < n; ++i) out[i] = k[i] * a[i];
}

TRIBIN_VECTOR_LEVELS double dot(std::size_t n, const double* __restrict a, const double* __restrict b) {
  double sum[kLanes] = {};
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) sum[k] += a[i + k] * b[i + k];
  for (; i < n; ++i) sum[0] += a[i] * b[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

TRIBIN_VECTOR_LEVELS double cost_of(std::size_t n, const double* __restrict e, double mu2) {
  double sum[kLanes] = {};
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) sum[k] += mu2 * (e[i + k] * e[i + k]) / (mu2 + e[i + k] * e[i + k]);
  for (; i < n; ++i) sum[0] += mu2 * (e[i] * e[i]) / (mu2 + e[i] * e[i]);
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

}  // namespace

void FitPoints::reserve(std::size_t count) {
  for (auto* v : {&x, &y, &z, &inverse_sigma}) v->reserve(count);
}

void FitPoints::add(const Vec3& p, double inverse) {
  x.push_back(p.x());
  y.push_back(p.y());
  z.push_back(p.z());
  inverse_sigma.push_back(inverse);
}

void linearise(const Surface& surface, const FitPoints& points, Linearised& out) {
  const std::size_t n = points.size();
  out.residual.resize(n);
  switch (surface.type) {
    case PrimitiveType::sphere:
      out.active = {0, 1, 2, 4};
      break;
    case PrimitiveType::cone:
      out.active = {0, 1, 2, 3, 4, 5};
      break;
    case PrimitiveType::torus:
      out.active = {0, 1, 2, 3, 4, 5, 6};
      break;
    default:
      out.active = {0, 1, 2, 3, 4};
  }
  auto& j = out.jacobian;
  for (auto& column : j) column.resize(n);
  const double *x = points.x.data(), *y = points.y.data(), *z = points.z.data(), *w = points.inverse_sigma.data();
  const Numbers numbers(surface);
  if (surface.type == PrimitiveType::sphere) {
    sphere_rows(numbers, n, x, y, z, w, out.residual.data(), j[0].data(), j[1].data(), j[2].data(), j[4].data());
    return;
  }
  if (surface.type == PrimitiveType::torus) {
    torus_rows(numbers, n, x, y, z, w, out.residual.data(), j[0].data(), j[1].data(), j[2].data(), j[3].data(),
               j[4].data(), j[5].data(), j[6].data());
    return;
  }
  axial_rows(numbers, n, x, y, z, w, out.residual.data(), j[0].data(), j[1].data(), j[2].data(), j[3].data(),
             j[4].data(), j[5].data());
}

NormalEquations weigh(const Linearised& at, double mu) {
  constexpr std::size_t kBlock = 256;  // stays in the first-level cache
  NormalEquations sum{Square::Zero(), Column::Zero()};
  std::array<std::array<double, kBlock>, kParameters> rows;
  std::array<double, kBlock> root, residual;
  for (std::size_t from = 0; from < at.residual.size(); from += kBlock) {
    const std::size_t n = std::min(kBlock, at.residual.size() - from);
    root_weights(n, at.residual.data() + from, mu * mu, root.data());
    scaled(n, root.data(), at.residual.data() + from, residual.data());
    for (int a : at.active) scaled(n, root.data(), at.jacobian[a].data() + from, rows[a].data());
    for (int a : at.active) {
      for (int b : at.active) {
        if (b > a) break;
        sum.h(a, b) += dot(n, rows[a].data(), rows[b].data());
      }
      sum.g[a] += dot(n, rows[a].data(), residual.data());
    }
  }
  sum.h = Square(sum.h.selfadjointView<Eigen::Lower>());
  return sum;
}

double robust_cost(const std::vector<double>& residual, double mu) {
  return cost_of(residual.size(), residual.data(), mu * mu);
}

Surface stepped(const Surface& surface, const Column& step) {
  Surface out = surface;
  out.radius += step[4];
  if (surface.type == PrimitiveType::sphere) {
    out.point += Vec3(step.head<3>());
    return out;
  }
  Vec3 u, v;
  orthonormal_basis(surface.axis, u, v);
  out.axis = (rotation_from_vector(u * step[0] + v * step[1]) * surface.axis).normalized();
  out.point += u * step[2] + v * step[3];
  if (surface.type == PrimitiveType::torus) {
    out.minor_radius += step[5];
    out.point += surface.axis * step[6];
  } else {
    out.half_angle += step[5];
  }
  return out;
}

void hold(NormalEquations& equations, const std::vector<int>& active, const FitOptions& options) {
  for (int i = 0; i < kParameters; ++i) {
    const bool held = (options.hold_radius && i == 4) || (options.hold_axis && i < 2);
    if (!held && std::find(active.begin(), active.end(), i) != active.end()) continue;
    equations.h.row(i).setZero();
    equations.h.col(i).setZero();
    equations.h(i, i) = 1;
    equations.g[i] = 0;
  }
}

}  // namespace tribin::segmentation_detail
