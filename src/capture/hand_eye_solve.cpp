#include "capture/hand_eye_solve.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace tribin::hand_eye_detail {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// sin(angle) axis: turned rotations have turned sine vectors, and unlike the logarithm it has no jump at half turns.
Vector3d sine_vector(const Matrix3d& r) {
  return 0.5 * Vector3d(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
}

}  // namespace

Matrix3d nearest_rotation(const Matrix3d& m) {
  const Eigen::JacobiSVD<Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

Equations::Equations(std::span<const HandEyePair> pairs, const HandEyeOptions& options) : options_(options) {
  for (const HandEyePair& pair : pairs) {
    a_.push_back(options.mount == CameraMount::fixed ? pair.base_from_flange : pair.base_from_flange.inverse());
    c_.push_back(pair.camera_from_target);
  }
}

bool Equations::start(std::span<const int> use, Solution& solution) const {
  return sphere() ? start_sphere(use, solution) : start_board(use, solution);
}

// A_i A_j^-1 X = X C_i C_j^-1: the turns between stops, seen from the robot and from the camera, differ by R_X alone.
bool Equations::start_board(std::span<const int> use, Solution& solution) const {
  Matrix3d moment = Matrix3d::Zero(), mean = Matrix3d::Zero();
  for (std::size_t i = 0; i < use.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      moment += sine_vector(a_[use[i]].linear() * a_[use[j]].linear().transpose()) *
                sine_vector(c_[use[i]].linear() * c_[use[j]].linear().transpose()).transpose();
  // Two turns about different axes fix the rotation: rank 2.
  const Eigen::JacobiSVD<Matrix3d> svd(moment);
  if (!(svd.singularValues()[1] > 1e-9)) return false;
  const Matrix3d rx = nearest_rotation(moment);
  for (int i : use) mean += a_[i].linear().transpose() * rx * c_[i].linear();
  solution.x.linear() = rx;
  solution.y.linear() = nearest_rotation(mean);

  // R_A t_Y - t_X = R_X t_C - t_A.
  const int n = static_cast<int>(use.size());
  MatrixXd m(3 * n, 6);
  VectorXd b(3 * n);
  for (int k = 0; k < n; ++k) {
    const int i = use[k];
    m.block<3, 3>(3 * k, 0) = a_[i].linear();
    m.block<3, 3>(3 * k, 3) = -Matrix3d::Identity();
    b.segment<3>(3 * k) = rx * c_[i].translation() - a_[i].translation();
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(m);
  if (qr.rank() < 6) return false;
  const VectorXd t = qr.solve(b);
  solution.y.translation() = t.head<3>();
  solution.x.translation() = t.tail<3>();
  return true;
}

// R_A y + t_A = M c + t_X, linear in y, M, t_X; M is then made a rotation. The places are centred and scaled, so that
// the columns are of one size. Places in one plane leave a column of M open: the smallest solution has 0 there, and the
// nearest rotation completes it.
bool Equations::start_sphere(std::span<const int> use, Solution& solution) const {
  const int n = static_cast<int>(use.size());
  Vector3d center = Vector3d::Zero();
  double size = 0;
  for (int i : use) center += c_[i].translation() / n;
  for (int i : use) size += (c_[i].translation() - center).norm() / n;
  if (!(size > 0)) return false;
  MatrixXd m = MatrixXd::Zero(3 * n, 15);
  VectorXd b(3 * n);
  for (int k = 0; k < n; ++k) {
    const int i = use[k];
    const Vector3d c = (c_[i].translation() - center) / size;
    m.block<3, 3>(3 * k, 0) = a_[i].linear();
    for (int column = 0; column < 3; ++column) m.block<3, 3>(3 * k, 3 + 3 * column) = -c[column] * Matrix3d::Identity();
    m.block<3, 3>(3 * k, 12) = -Matrix3d::Identity();
    b.segment<3>(3 * k) = -a_[i].translation();
  }
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver(m.rows(), m.cols());
  solver.setThreshold(1e-3);  // a plane's thickness, as a share of its extent, that noise could have made
  const VectorXd s = solver.compute(m).solve(b);
  Matrix3d scaled;
  for (int column = 0; column < 3; ++column) scaled.col(column) = s.segment<3>(3 + 3 * column) / size;
  solution.x.linear() = nearest_rotation(scaled);
  solution.y.linear() = Matrix3d::Identity();
  MatrixXd m2(3 * n, 6);
  for (int k = 0; k < n; ++k) {
    const int i = use[k];
    m2.block<3, 3>(3 * k, 0) = a_[i].linear();
    m2.block<3, 3>(3 * k, 3) = -Matrix3d::Identity();
    b.segment<3>(3 * k) = solution.x.linear() * c_[i].translation() - a_[i].translation();
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(m2);
  if (qr.rank() < 6) return false;
  const VectorXd t = qr.solve(b);
  solution.y.translation() = t.head<3>();
  solution.x.translation() = t.tail<3>();
  return true;
}

Vector6 Equations::error(const Solution& s, int i, int j) const {
  const Matrix3d to_camera = s.x.linear().transpose();
  Vector6 e = Vector6::Zero();
  e.head<3>() =
      to_camera * (a_[i].linear() * s.y.translation() + a_[i].translation() - s.x.translation()) - c_[j].translation();
  if (!sphere())
    e.tail<3>() = vector_from_rotation(Matrix3(to_camera * a_[i].linear() * s.y.linear() * c_[j].linear().transpose()));
  return e;
}

// A flange turned by w about its own place moves the target by w x lever, lever = flange to target; the signs of the
// hand-held camera, where the inverse pose enters, are all opposite, which a covariance does not see.
Eigen::Matrix<double, 6, 6> Equations::covariance(const Solution& s, int i) const {
  const HandEyeNoise& noise = options_.noise;
  const bool fixed = options_.mount == CameraMount::fixed;
  const Vector3d lever = s.x.linear().transpose() *
                         (a_[i].linear() * s.y.translation() + (fixed ? Vec3(0, 0, 0) : Vec3(a_[i].translation())));
  const Matrix3d turn = -cross_matrix(lever);
  const double turn2 = noise.robot_rad * noise.robot_rad;
  Eigen::Matrix<double, 6, 6> c;
  c.topLeftCorner<3, 3>() =
      turn2 * turn * turn.transpose() +
      (noise.robot_mm * noise.robot_mm + noise.camera_mm * noise.camera_mm) * Matrix3d::Identity();
  c.topRightCorner<3, 3>() = turn2 * turn;
  c.bottomLeftCorner<3, 3>() = turn2 * turn.transpose();
  c.bottomRightCorner<3, 3>() = (turn2 + noise.camera_rad * noise.camera_rad) * Matrix3d::Identity();
  return c;
}

double Equations::chi2(const Solution& s, int i, int j) const {
  const Eigen::Matrix<double, 6, 6> c = covariance(s, i);
  const Eigen::Matrix<double, 6, 1> e = error(s, i, j);
  if (sphere()) return e.head<3>().dot(c.topLeftCorner<3, 3>().llt().solve(e.head<3>()));
  return e.dot(c.llt().solve(e));
}

Solution Equations::refine(std::span<const int> use, Solution s, Matrix12* information) const {
  // Rotation of Y is no unknown of a sphere: its rows stay the identity, and its step 0.
  const int rows = residuals_per_pair();
  Matrix12 h;
  for (int round = 0; round < 30; ++round) {
    h.setZero();
    Eigen::Matrix<double, 12, 1> g = Eigen::Matrix<double, 12, 1>::Zero();
    const Matrix3d to_camera = s.x.linear().transpose();
    for (int i : use) {
      const Vector3d p = a_[i].linear() * s.y.translation() + a_[i].translation() - s.x.translation();
      const Matrix3d turned = to_camera * a_[i].linear();
      Eigen::Matrix<double, 6, 12> j = Eigen::Matrix<double, 6, 12>::Zero();
      j.block<3, 3>(0, 0) = -to_camera;
      j.block<3, 3>(0, 3) = to_camera * cross_matrix(p);
      j.block<3, 3>(0, 6) = turned;
      j.block<3, 3>(3, 3) = -to_camera;
      j.block<3, 3>(3, 9) = turned;
      const Eigen::Matrix<double, 6, 1> e = error(s, i, i);
      const Eigen::MatrixXd c = covariance(s, i).topLeftCorner(rows, rows);
      const Eigen::LLT<Eigen::MatrixXd> llt(c);
      h += j.topRows(rows).transpose() * llt.solve(j.topRows(rows));
      g += j.topRows(rows).transpose() * llt.solve(e.head(rows));
    }
    if (sphere()) h.bottomRightCorner<3, 3>() = Matrix3d::Identity();
    const Eigen::Matrix<double, 12, 1> step = -h.ldlt().solve(g);
    if (!step.allFinite()) break;
    s.x = moved(s.x, Vector6(step.head<6>()));
    s.y = moved(s.y, Vector6(step.tail<6>()));
    // In sigmas: a step of 1e-6 of the result's own uncertainty changes nothing.
    if (step.dot(h * step) < 1e-12) break;
  }
  if (information) *information = h;
  return s;
}

}  // namespace tribin::hand_eye_detail
