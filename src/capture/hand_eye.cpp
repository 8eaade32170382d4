#include "tribin/capture/hand_eye.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <string>

#include "capture/hand_eye_solve.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using namespace hand_eye_detail;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void check(std::span<const HandEyePair> pairs, const HandEyeOptions& options) {
  const HandEyeNoise& noise = options.noise;
  for (const auto& [name, value] : {std::pair{"robot_mm", noise.robot_mm},
                                    {"robot_deg", noise.robot_rad},
                                    {"camera_mm", noise.camera_mm},
                                    {"camera_deg", noise.camera_rad}})
    if (!(value > 0) || !std::isfinite(value))
      throw Error(ErrorCode::bad_option,
                  std::string("noise.") + name + ": saw " + std::to_string(value) + ", wanted a number > 0");
  const int wanted = fewest_pairs(options.target);
  if (static_cast<int>(pairs.size()) < wanted)
    throw Error(ErrorCode::too_little_data, "hand-eye: saw " + std::to_string(pairs.size()) + " pairs, wanted " +
                                                std::to_string(wanted) + " or more (12 to 15 are good)");
}

/// How far the axes of all turns between the robot's poses lie from their main direction; 0 where nothing turns.
double axis_spread(const Equations& equations, const Indices& use) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  int turns = 0;
  for (std::size_t i = 0; i < use.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j, ++turns) {
      const Vec3 w = vector_from_rotation(
          Matrix3(equations.robot()[use[i]].linear() * equations.robot()[use[j]].linear().transpose()));
      scatter += w * w.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d l = solver.eigenvalues().cwiseMax(0);
  if (std::sqrt(l[2] / turns) < kParallelAxes) return 0;  // turns of less than a degree have no axis to speak of
  return std::atan(std::sqrt(l[1] / l[2]));
}

void check_axes(double spread, std::size_t count) {
  if (spread >= kParallelAxes) return;
  throw Error(ErrorCode::too_little_data, "hand-eye: saw " + std::to_string(count) +
                                              " robot poses whose turns have parallel axes (" +
                                              std::to_string(spread / kDegree) +
                                              " deg apart), wanted axes 15 deg apart or more: tilt the flange "
                                              "both ways beside turning it");
}

/// The upper 0.1 % point of chi-square over its degrees of freedom, by Wilson and Hilferty.
double upper_factor(double dof) {
  const double v = 2 / (9 * dof);
  return std::pow(1 - v + 3.09 * std::sqrt(v), 3);
}

void fill_uncertainty(const Equations& equations, const Consensus& consensus, HandEye& out) {
  Matrix12 information;
  equations.refine(consensus.used, consensus.solution, &information);
  const Matrix12 covariance = information.ldlt().solve(Matrix12::Identity());
  const Eigen::Matrix<double, 6, 6> c = consensus.variance_factor * covariance.topLeftCorner<6, 6>();
  out.covariance = 0.5 * (c + c.transpose());
  out.sigma_mm = std::sqrt(c.topLeftCorner<3, 3>().trace());
  out.sigma_rad = std::sqrt(c.bottomRightCorner<3, 3>().trace());

  Vec3 lever = Vec3::Zero();  // from the camera to the middle of the targets, parent's axes
  const Solution& s = consensus.solution;
  for (int i : consensus.used)
    lever += (equations.robot()[i] * Vec3(s.y.translation()) - s.x.translation()) / consensus.used.size();
  Eigen::Matrix<double, 3, 6> j;
  j.leftCols<3>().setIdentity();
  for (int axis = 0; axis < 3; ++axis) j.col(3 + axis) = Vec3(Vec3::Unit(axis)).cross(lever);
  out.sigma_at_targets_mm = std::sqrt((j * c * j.transpose()).trace());
}

void fill_residuals(const Equations& equations, const Consensus& consensus, HandEye& out) {
  const int n = equations.size(), k = equations.residuals_per_pair();
  out.pairs.resize(n);
  for (HandEyeResidual& r : out.pairs) r.used = false;
  for (int i : consensus.used) out.pairs[i].used = true;
  for (int i = 0; i < n; ++i) {
    HandEyeResidual& r = out.pairs[i];
    const Vector6 e = equations.error(consensus.solution, i, i);
    r.error_mm = e.head<3>().norm();
    r.error_rad = e.tail<3>().norm();
    r.deviation = std::sqrt(equations.chi2(consensus.solution, i, i) / k);
    r.left_out_mm = r.error_mm;
    r.left_out_rad = r.error_rad;
    if (!r.used) {
      out.outliers.push_back(i);
      continue;
    }
    Indices others;
    for (int j : consensus.used)
      if (j != i) others.push_back(j);
    const bool enough = static_cast<int>(others.size()) * k > equations.unknowns();
    const Vector6 left_out =
        enough ? equations.error(equations.refine(others, consensus.solution), i, i) : Vector6(Vector6::Constant(kNan));
    r.left_out_mm = left_out.head<3>().norm();
    r.left_out_rad = left_out.tail<3>().norm();
    const double share = 1.0 / consensus.used.size();
    out.rms_mm += share * r.error_mm * r.error_mm;
    out.rms_rad += share * r.error_rad * r.error_rad;
    out.left_out_rms_mm += share * r.left_out_mm * r.left_out_mm;
    out.left_out_rms_rad += share * r.left_out_rad * r.left_out_rad;
  }
  for (double* mean_square : {&out.rms_mm, &out.rms_rad, &out.left_out_rms_mm, &out.left_out_rms_rad})
    *mean_square = std::sqrt(*mean_square);
}

/// Outliers whose robot pose fits another stop's camera pose: swapped, or paired one off.
void name_mistaken_pairs(const Equations& equations, const Consensus& consensus, HandEye& out) {
  for (int i : out.outliers) {
    double best = consensus.outlier_chi2;
    for (int j = 0; j < equations.size(); ++j) {
      const double chi2 = equations.chi2(consensus.solution, i, j);
      if (j != i && chi2 < best) best = chi2, out.pairs[i].fits_camera_of = j;
    }
  }
  for (int i : out.outliers) {
    const int j = out.pairs[i].fits_camera_of;
    if (j > i && out.pairs[j].fits_camera_of == i) out.swapped.emplace_back(i, j);
  }
}

}  // namespace

int fewest_pairs(HandEyeTarget target) { return target == HandEyeTarget::board ? 3 : 5; }

HandEye calibrate_hand_eye(std::span<const HandEyePair> pairs, const HandEyeOptions& options) {
  check(pairs, options);
  const Equations equations(pairs, options);
  Indices all;
  for (int i = 0; i < equations.size(); ++i) all.push_back(i);
  check_axes(axis_spread(equations, all), all.size());

  const Consensus consensus = find_consensus(equations);
  HandEye out;
  out.parent_from_camera = consensus.solution.x;
  out.holder_from_target = consensus.solution.y;
  out.variance_factor = consensus.variance_factor;
  out.axis_spread_rad = axis_spread(equations, consensus.used);
  check_axes(out.axis_spread_rad, consensus.used.size());
  out.nearly_parallel_axes = out.axis_spread_rad < kNearlyParallelAxes;
  const double dof = static_cast<double>(equations.residuals_per_pair() * consensus.used.size()) - equations.unknowns();
  out.noisier_than_stated = dof > 0 && out.variance_factor > upper_factor(dof);
  fill_uncertainty(equations, consensus, out);
  fill_residuals(equations, consensus, out);
  name_mistaken_pairs(equations, consensus, out);
  return out;
}

}  // namespace tribin
