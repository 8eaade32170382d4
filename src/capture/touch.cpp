#include "tribin/capture/touch.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using Points = Eigen::Matrix3Xd;

// A side of the workspace is halved where it is longer than this: errors of one calibration do not change over less.
constexpr double kHalvedFromMm = 50;

/// \throws Error too_little_data where the points leave a turn about their line open.
void check_spread(const Points& centered) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(centered * centered.transpose());
  const Eigen::VectorXd l = svd.singularValues();
  const double along = std::sqrt(l[0]), across = std::sqrt(l[1]);
  if (across > 0.05 * along) return;  // below it, a touch 0.1 mm off turns the answer by 2 mm at the line's length
  throw Error(ErrorCode::too_little_data, "touch: saw points on one line (" + std::to_string(across) + " mm across, " +
                                              std::to_string(along) + " mm along), wanted points that span an area");
}

/// The upper 0.1 % point of F(m, n), by Paulson's approximation on cube roots (Wilson and Hilferty).
double upper_f(double m, double n) {
  constexpr double z = 3.09;
  const double a = 2 / (9 * m), b = 2 / (9 * n), c = 1 - b, p = 1 - a;
  const double q = c * c - z * z * b;
  if (q <= 0) return 1e300;  // so few degrees of freedom that nothing stands out
  const double root = (c * p + z * std::sqrt(c * c * a + p * p * b - z * z * a * b)) / q;
  return root * root * root;
}

std::vector<TouchRegion> regions_of(std::span<const TouchedPoint> points, const std::vector<Vec3>& errors) {
  Vec3 low = points[0].touched_mm, high = low;
  for (const TouchedPoint& p : points) {
    low = low.cwiseMin(p.touched_mm);
    high = high.cwiseMax(p.touched_mm);
  }
  std::vector<TouchRegion> octants(8);
  for (std::size_t i = 0; i < points.size(); ++i) {
    int octant = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (high[axis] - low[axis] > kHalvedFromMm && points[i].touched_mm[axis] > 0.5 * (low[axis] + high[axis]))
        octant |= 1 << axis;
    octants[octant].points.push_back(static_cast<int>(i));
  }
  std::erase_if(octants, [](const TouchRegion& region) { return region.points.empty(); });
  for (TouchRegion& region : octants) {
    region.min_mm = region.max_mm = points[region.points[0]].touched_mm;
    for (int i : region.points) {
      region.min_mm = region.min_mm.cwiseMin(points[i].touched_mm);
      region.max_mm = region.max_mm.cwiseMax(points[i].touched_mm);
      region.mean_error_mm += errors[i] / static_cast<double>(region.points.size());
      region.rms_mm += errors[i].squaredNorm() / static_cast<double>(region.points.size());
    }
    region.rms_mm = std::sqrt(region.rms_mm);
  }
  return octants;
}

}  // namespace

TouchResult evaluate_touch(std::span<const TouchedPoint> points) {
  const int n = static_cast<int>(points.size());
  if (n < 3)
    throw Error(ErrorCode::too_little_data,
                "touch: saw " + std::to_string(n) + " points, wanted 3 or more (8 to 12 are good)");
  TouchResult out;
  Points predicted(3, n), touched(3, n);
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    predicted.col(i) = points[i].predicted_mm;
    touched.col(i) = points[i].touched_mm;
    out.error_mm.push_back(points[i].touched_mm - points[i].predicted_mm);
    out.mean_error_mm += out.error_mm.back() / n;
    out.max_mm = std::max(out.max_mm, out.error_mm.back().norm());
    sum += out.error_mm.back().squaredNorm();
  }
  out.rms_mm = std::sqrt(sum / n);
  const Points from = predicted.colwise() - predicted.rowwise().mean();
  const Points to = touched.colwise() - touched.rowwise().mean();
  check_spread(from);

  out.touched_from_predicted.matrix() = Eigen::umeyama(predicted, touched, false);
  const Eigen::Matrix3d turn = out.touched_from_predicted.linear();
  out.rotation_rad = rotation_angle(Matrix3::Identity(), Matrix3(turn));
  double left = 0;
  for (int i = 0; i < n; ++i) {
    out.residual_mm.push_back((to.col(i) - turn * from.col(i)).norm());
    left += out.residual_mm.back() * out.residual_mm.back();
  }
  out.residual_rms_mm = std::sqrt(left / n);
  const double dof = 3 * n - 6;
  out.residual_sigma_mm = std::sqrt(left / dof);
  out.rigid_error = sum - left > 6 * upper_f(6, dof) * left / dof;

  const double length2 = from.squaredNorm();
  out.scale = (turn * from).cwiseProduct(to).sum() / length2;
  const double left_scaled = std::max(0.0, left - (out.scale - 1) * (out.scale - 1) * length2);
  out.scale_sigma = std::sqrt(left_scaled / (dof - 1) / length2);
  out.scale_error = n >= 6 && std::abs(out.scale - 1) > 4 * out.scale_sigma;  // fewer points do not know their sigma
  out.regions = regions_of(points, out.error_mm);
  return out;
}

}  // namespace tribin
