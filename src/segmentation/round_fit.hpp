#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "segmentation/fitting.hpp"

namespace tribin::segmentation_detail {

inline constexpr int kParameters = 6;  ///< in the order of Primitive::covariance
using Square = Eigen::Matrix<double, kParameters, kParameters>;
using Column = Eigen::Matrix<double, kParameters, 1>;

/// The points of a fit, coordinate by coordinate.
struct FitPoints {
  std::vector<double> x, y, z;        ///< mm
  std::vector<double> inverse_sigma;  ///< 1 / mm, along the surface's normal

  std::size_t size() const { return x.size(); }
  void reserve(std::size_t count);
  void add(const Vec3& p, double inverse);
};

/// Residuals of all points about a surface and their derivatives, both in sigmas.
struct Linearised {
  std::vector<double> residual;
  std::array<std::vector<double>, kParameters> jacobian;
};

/// Geometric distances to a cylinder, cone or sphere and what a step of each parameter changes. A cylinder's half
/// angle has its derivative too: where it is held, the caller holds it.
void linearise(const Surface& surface, const FitPoints& points, Linearised& out);

/// Least squares of the linearised residuals with Geman-McClure weights of width `mu` sigmas.
struct NormalEquations {
  Square h;
  Column g;
};
NormalEquations weigh(const Linearised& at, double mu);

/// Sum of mu^2 e^2 / (mu^2 + e^2).
double robust_cost(const std::vector<double>& residual, double mu);

/// A surface moved by a step of its parameters.
Surface stepped(const Surface& surface, const Column& step);

/// Freezes the parameters that a fit holds: unit rows and columns.
void hold(NormalEquations& equations, const Surface& surface, const FitOptions& options);

}  // namespace tribin::segmentation_detail
