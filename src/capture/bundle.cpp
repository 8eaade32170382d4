#include "capture/bundle.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <utility>

#include "tribin/core/error.hpp"

namespace tribin::calibration_detail {
namespace {

constexpr int kOfDevice = 15;  // 9 intrinsics and a pose
constexpr double kHuber = 2.5;

using Local = Eigen::Matrix<double, 21, 21>;  // a device's 15 and a view's 6
using LocalVector = Eigen::Matrix<double, 21, 1>;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

Eigen::Matrix3d cross_matrix(const Vec3& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// A point's pixel and how it moves.
struct Projection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 9> by_intrinsics;
  Matrix23 by_point;
};

Projection project_with_slopes(const Intrinsics& p, const Eigen::Vector3d& q) {
  const double x = q.x() / q.z(), y = q.y() / q.z(), r2 = x * x + y * y;
  const double fx = p[0], fy = p[1], k1 = p[4], k2 = p[5], p1 = p[6], p2 = p[7], k3 = p[8];
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), slope = k1 + r2 * (2 * k2 + r2 * 3 * k3);  // d / d r2
  const double dx = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double dy = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  Projection out;
  out.pixel = {fx * dx + p[2], fy * dy + p[3]};
  out.by_intrinsics.setZero();
  out.by_intrinsics.row(0) << dx, 0, 1, 0, fx * x * r2, fx * x * r2 * r2, fx * 2 * x * y, fx * (r2 + 2 * x * x),
      fx * x * r2 * r2 * r2;
  out.by_intrinsics.row(1) << 0, dy, 0, 1, fy * y * r2, fy * y * r2 * r2, fy * (r2 + 2 * y * y), fy * 2 * x * y,
      fy * y * r2 * r2 * r2;
  const double xx = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x;
  const double xy = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
  const double yy = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x;
  Eigen::Matrix2d by_ideal;
  by_ideal << fx * xx, fx * xy, fy * xy, fy * yy;
  Matrix23 ideal_by_point;
  ideal_by_point << 1 / q.z(), 0, -x / q.z(), 0, 1 / q.z(), -y / q.z();
  out.by_point = by_ideal * ideal_by_point;
  return out;
}

double huber_cost(double square) {
  return square <= kHuber * kHuber ? square : 2 * kHuber * std::sqrt(square) - kHuber * kHuber;
}

double prior_cost(const Device& d) {
  double sum = 0;
  for (int i = 0; i < 9; ++i)
    if (d.prior_sd[i] > 0) sum += std::pow((d.intrinsics[i] - d.prior_mean[i]) / d.prior_sd[i], 2);
  return sum;
}

double cost_of(const Bundle& bundle, const Sight& sight, Loss loss) {
  double sum = 0;
  const std::vector<Vec2> off = residuals(bundle, sight);
  const double sigma = bundle.devices[sight.device].sigma;
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (!sight.used[i]) continue;
    const double square = off[i].squaredNorm() / (sigma * sigma);
    if (!std::isfinite(square)) return std::numeric_limits<double>::infinity();
    sum += loss == Loss::huber ? huber_cost(square) : square;
  }
  return sum;
}

double cost_of(const Bundle& bundle, Loss loss) {
  double sum = 0;
  for (const Device& d : bundle.devices) sum += prior_cost(d);
  for (const Sight& s : bundle.sights)
    if (bundle.view_used[s.view]) sum += cost_of(bundle, s, loss);
  return sum;
}

/// Adds J^T J and J^T r of a sight. A view's delta is (dt, w) of rig_from_board, R' = Exp(w) R.
void add_sight(const Bundle& bundle, const Sight& sight, Loss loss, Local& square, LocalVector& right) {
  const Device& device = bundle.devices[sight.device];
  const Pose& board = bundle.rig_from_board[sight.view];
  const Eigen::Matrix3d back = device.rig_from_device.linear().transpose();
  Eigen::Matrix<double, 2, 21> j;
  for (std::size_t i = 0; i < sight.point.size(); ++i) {
    if (!sight.used[i]) continue;
    const Eigen::Vector3d turned = board.linear() * sight.point[i], in_rig = turned + board.translation();
    const Eigen::Vector3d lever = in_rig - device.rig_from_device.translation();
    const Projection p = project_with_slopes(device.intrinsics, back * lever);
    const Eigen::Vector2d off = p.pixel - sight.pixel[i];
    const Matrix23 by_rig = p.by_point * back;
    j.leftCols<9>() = p.by_intrinsics;
    j.middleCols<3>(9) = -by_rig;
    j.middleCols<3>(12) = by_rig * cross_matrix(lever);
    j.middleCols<3>(15) = by_rig;
    j.middleCols<3>(18) = -by_rig * cross_matrix(turned);
    double weight = 1 / (device.sigma * device.sigma);
    const double size = off.norm() / device.sigma;
    if (loss == Loss::huber && size > kHuber) weight *= kHuber / size;
    square.noalias() += weight * j.transpose() * j;
    right.noalias() += weight * j.transpose() * off;
  }
}

/// The normal equations with the views' blocks apart.
struct Normal {
  Eigen::MatrixXd shared;
  Eigen::VectorXd shared_right;
  std::vector<Matrix6> view;
  std::vector<Vector6> view_right;
  std::vector<Eigen::MatrixXd> cross;  // shared x 6
};

/// Stretches of the shared parameters that do not move: the first device's pose holds the rig's frame, and all of what
/// is fixed.
std::vector<std::pair<int, int>> held_parameters(const Bundle& bundle) {
  std::vector<std::pair<int, int>> out{{9, 6}};
  for (std::size_t d = 0; d < bundle.devices.size(); ++d)
    if (bundle.devices[d].fixed) out.emplace_back(kOfDevice * static_cast<int>(d), kOfDevice);
  return out;
}

Normal normal_equations(const Bundle& bundle, Loss loss) {
  const int shared = kOfDevice * static_cast<int>(bundle.devices.size());
  const std::size_t views = bundle.rig_from_board.size();
  Normal n;
  n.shared = Eigen::MatrixXd::Zero(shared, shared);
  n.shared_right = Eigen::VectorXd::Zero(shared);
  n.view.assign(views, Matrix6::Zero());
  n.view_right.assign(views, Vector6::Zero());
  n.cross.assign(views, Eigen::MatrixXd::Zero(shared, 6));
  for (const Sight& s : bundle.sights) {
    if (!bundle.view_used[s.view]) continue;
    Local square = Local::Zero();
    LocalVector right = LocalVector::Zero();
    add_sight(bundle, s, loss, square, right);
    const int at = kOfDevice * s.device;
    n.shared.block<15, 15>(at, at) += square.topLeftCorner<15, 15>();
    n.shared_right.segment<15>(at) += right.head<15>();
    n.view[s.view] += square.bottomRightCorner<6, 6>();
    n.view_right[s.view] += right.tail<6>();
    n.cross[s.view].middleRows<15>(at) += square.topRightCorner<15, 6>();
  }
  for (std::size_t d = 0; d < bundle.devices.size(); ++d) {
    const Device& device = bundle.devices[d];
    const int at = kOfDevice * static_cast<int>(d);
    for (int i = 0; i < 9; ++i) {
      if (!(device.prior_sd[i] > 0)) continue;
      const double weight = 1 / (device.prior_sd[i] * device.prior_sd[i]);
      n.shared(at + i, at + i) += weight;
      n.shared_right[at + i] += weight * (device.intrinsics[i] - device.prior_mean[i]);
    }
  }
  for (const auto& [begin, count] : held_parameters(bundle)) {
    n.shared.middleRows(begin, count).setZero();
    n.shared.middleCols(begin, count).setZero();
    n.shared.block(begin, begin, count, count).setIdentity();
    n.shared_right.segment(begin, count).setZero();
    for (Eigen::MatrixXd& c : n.cross) c.middleRows(begin, count).setZero();
  }
  return n;
}

/// One step of all parameters for a damping; false where the equations have no solution.
bool stepped(const Bundle& from, const Normal& n, double damping, Bundle& to) {
  Eigen::MatrixXd reduced = n.shared;
  reduced.diagonal() *= 1 + damping;
  Eigen::VectorXd right = n.shared_right;
  std::vector<Eigen::Matrix<double, 6, 6>> inverse(n.view.size());
  for (std::size_t v = 0; v < n.view.size(); ++v) {
    if (!from.view_used[v]) continue;
    Eigen::Matrix<double, 6, 6> square = n.view[v];
    square.diagonal() *= 1 + damping;
    inverse[v] = square.inverse();
    reduced -= n.cross[v] * inverse[v] * n.cross[v].transpose();
    right -= n.cross[v] * (inverse[v] * n.view_right[v]);
  }
  const Eigen::LDLT<Eigen::MatrixXd> solver(reduced);
  const Eigen::VectorXd shared = solver.solve(right);
  if (!shared.allFinite()) return false;
  to = from;
  for (std::size_t d = 0; d < to.devices.size(); ++d) {
    const auto part = shared.segment<15>(kOfDevice * static_cast<int>(d));
    to.devices[d].intrinsics -= part.head<9>();
    to.devices[d].rig_from_device = moved(from.devices[d].rig_from_device, -part.tail<6>());
    if (!(to.devices[d].intrinsics[0] > 0) || !(to.devices[d].intrinsics[1] > 0)) return false;
  }
  for (std::size_t v = 0; v < n.view.size(); ++v) {
    if (!from.view_used[v]) continue;
    const Vector6 delta = inverse[v] * (n.view_right[v] - n.cross[v].transpose() * shared);
    to.rig_from_board[v] = moved(from.rig_from_board[v], -delta);
  }
  return true;
}

/// The pose of a view alone, the devices as they are.
void place_view(Bundle& bundle, int view, Loss loss) {
  std::vector<const Sight*> own;
  for (const Sight& s : bundle.sights)
    if (s.view == view) own.push_back(&s);
  const auto cost = [&] {
    double sum = 0;
    for (const Sight* s : own) sum += cost_of(bundle, *s, loss);
    return sum;
  };
  double damping = 1e-3, now = cost();
  for (int round = 0; round < 30 && damping < 1e8 && std::isfinite(now); ++round) {
    Local square = Local::Zero();
    LocalVector right = LocalVector::Zero();
    for (const Sight* s : own) add_sight(bundle, *s, loss, square, right);
    Eigen::Matrix<double, 6, 6> damped = square.bottomRightCorner<6, 6>();
    damped.diagonal() *= 1 + damping;
    const Pose before = bundle.rig_from_board[view];
    bundle.rig_from_board[view] = moved(before, -damped.ldlt().solve(right.tail<6>()));
    const double next = cost();
    if (next <= now) {
      const bool done = now - next < 1e-9 * now;
      now = next, damping *= 0.1;
      if (done) break;
    } else {
      bundle.rig_from_board[view] = before;
      damping *= 10;
    }
  }
}

}  // namespace

Vec2 project(const Intrinsics& p, const Vec3& point) {
  if (!(point.z() > 0)) return Vec2::Constant(std::nan(""));
  const Vec2 q = distorted({p[4], p[5], p[6], p[7], p[8]}, Vec2(point.x() / point.z(), point.y() / point.z()));
  return {p[0] * q.x() + p[2], p[1] * q.y() + p[3]};
}

std::vector<Vec2> residuals(const Bundle& bundle, const Sight& sight) {
  const Device& device = bundle.devices[sight.device];
  const Pose device_from_board = device.rig_from_device.inverse() * bundle.rig_from_board[sight.view];
  std::vector<Vec2> out;
  out.reserve(sight.point.size());
  for (std::size_t i = 0; i < sight.point.size(); ++i)
    out.push_back(project(device.intrinsics, device_from_board * sight.point[i]) - sight.pixel[i]);
  return out;
}

double refine(Bundle& bundle, Loss loss, int rounds) {
  double now = cost_of(bundle, loss), damping = 1e-3;
  Bundle next;
  for (int round = 0; round < rounds; ++round) {
    const Normal normal = normal_equations(bundle, loss);
    bool better = false;
    double then = now;
    for (; damping < 1e10; damping *= 10) {
      if (!stepped(bundle, normal, damping, next)) continue;
      then = cost_of(next, loss);
      better = then <= now;  // false for NaN too
      if (better) break;
    }
    if (!better) break;
    const bool done = now - then < 1e-10 * now;
    bundle = next, now = then;
    damping = std::max(damping * 0.1, 1e-12);
    if (done) break;
  }
  for (std::size_t v = 0; v < bundle.view_used.size(); ++v)
    if (!bundle.view_used[v]) place_view(bundle, static_cast<int>(v), loss);
  return now;
}

Eigen::MatrixXd covariance(const Bundle& bundle) {
  const Normal n = normal_equations(bundle, Loss::squares);
  Eigen::MatrixXd reduced = n.shared;
  for (std::size_t v = 0; v < n.view.size(); ++v)
    if (bundle.view_used[v])
      reduced -= n.cross[v] * Eigen::Matrix<double, 6, 6>(n.view[v]).inverse() * n.cross[v].transpose();
  // Parameters differ by orders of magnitude (pixels, k3): scaled to a unit diagonal before the inverse.
  const Eigen::VectorXd scale = reduced.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * reduced * scale.asDiagonal();
  Eigen::MatrixXd out = scale.asDiagonal() *
                        scaled.ldlt().solve(Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols())) *
                        scale.asDiagonal();
  for (const auto& [begin, count] : held_parameters(bundle)) {
    out.middleRows(begin, count).setZero();
    out.middleCols(begin, count).setZero();
  }
  return 0.5 * (out + out.transpose());
}

}  // namespace tribin::calibration_detail
