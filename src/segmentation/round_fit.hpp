#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "segmentation/fitting.hpp"

namespace tribin::segmentation_detail {

/// Tilt about u, tilt about v, shift along u, shift along v, radius, half angle or minor radius, shift along the axis;
/// sphere: the centre in 0-2, the radius in 4. The first six are the order of Primitive::covariance.
inline constexpr int kParameters = 7;
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
  std::array<std::vector<double>, kParameters> jacobian;  ///< of the active parameters; the others are not looked at
  std::vector<int> active;
};

/// Geometric distances to a cylinder, cone, sphere or torus and what a step of each of its parameters changes.
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

/// Freezes the parameters that are not active, and those that the options hold: unit rows and columns.
void hold(NormalEquations& equations, const std::vector<int>& active, const FitOptions& options);

}  // namespace tribin::segmentation_detail
