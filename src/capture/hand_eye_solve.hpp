#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "tribin/capture/hand_eye.hpp"

/// The equation of both mounts, A_i Y = X C_i: A = parent_from_holder (fixed: base_from_flange, hand:
/// flange_from_base), X = parent_from_camera, Y = holder_from_target, C = camera_from_target.
namespace tribin::hand_eye_detail {

using Matrix12 = Eigen::Matrix<double, 12, 12>;
using Indices = std::vector<int>;

struct Solution {
  Pose x = Pose::Identity();
  Pose y = Pose::Identity();
};

class Equations {
 public:
  Equations(std::span<const HandEyePair> pairs, const HandEyeOptions& options);

  int size() const { return static_cast<int>(a_.size()); }
  bool sphere() const { return options_.target == HandEyeTarget::sphere; }
  int residuals_per_pair() const { return sphere() ? 3 : 6; }
  int unknowns() const { return sphere() ? 9 : 12; }
  const std::vector<Pose>& robot() const { return a_; }

  /// A closed-form start from these pairs; false where they do not fix it.
  bool start(std::span<const int> use, Solution& solution) const;
  /// Gauss-Newton on these pairs; `information` (X first, then Y) where wanted.
  Solution refine(std::span<const int> use, Solution solution, Matrix12* information = nullptr) const;

  /// Target as predicted minus as seen, camera axes: (mm, rad), of robot pose i against camera pose j.
  Vector6 error(const Solution& solution, int i, int j) const;
  /// Its square in sigmas: chi-square with residuals_per_pair degrees of freedom.
  double chi2(const Solution& solution, int i, int j) const;

 private:
  Eigen::Matrix<double, 6, 6> covariance(const Solution& solution, int i) const;
  bool start_board(std::span<const int> use, Solution& solution) const;
  bool start_sphere(std::span<const int> use, Solution& solution) const;

  HandEyeOptions options_;
  std::vector<Pose> a_, c_;
};

/// The pairs that agree with the largest consistent majority, and the fit to them.
struct Consensus {
  Solution solution;
  Indices used;
  double variance_factor = 1;
  double outlier_chi2 = 0;  ///< a pair with more (unscaled) does not fit
};
Consensus find_consensus(const Equations& equations);

/// The rotation nearest to a matrix in the sense of squares.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace tribin::hand_eye_detail
