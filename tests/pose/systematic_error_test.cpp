#include "tribin/pose/systematic_error.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace tribin {
namespace {

using Mat6 = Eigen::Matrix<double, 6, 6>;
using Vec6 = Eigen::Matrix<double, 6, 1>;

/// A surface of patches as a fit sees them, and the fit's error.
struct Fitted {
  std::vector<ErrorPatch> patches;
  Mat6 held;
  Vec6 error;
};

/// Patches with a field of sd `field_mm` and their noise; the pose follows what they are off by.
/// \param lone  so many of them alone hold a direction, with much weight.
Fitted fitted(int count, int lone, double field_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Fitted out;
  Mat6 information = Mat6::Zero();
  std::vector<double> off;
  for (int k = 0; k < count; ++k) {
    Vec6 jacobian = Vec6::Zero();
    if (k < lone)
      jacobian[5 - k] = 1;
    else
      for (int i = 0; i < 6 - lone; ++i) jacobian[i] = normal(random);
    ErrorPatch patch;
    patch.weight = 1 / (0.005 * 0.005) * (1 + k % 3);
    patch.pull = Vector6(jacobian * patch.weight);
    patch.place_mm = Vec2(1000.0 * k, 0);  // none shares anything with another
    information += jacobian * jacobian.transpose() * patch.weight;
    off.push_back(field_mm * normal(random) + normal(random) / std::sqrt(patch.weight));
    out.patches.push_back(patch);
  }
  out.held = information.inverse();
  out.error.setZero();
  for (int k = 0; k < count; ++k) out.error += out.held * Vec6(out.patches[k].pull) * off[k];
  for (int k = 0; k < count; ++k)
    out.patches[k].residual_mm = off[k] - Vec6(out.patches[k].pull).dot(out.error) / out.patches[k].weight;
  return out;
}

TEST(FieldVariance, IsWhatThePatchesAreOffByThoughTheFitFollowsThem) {
  for (const double field_mm : {0.0, 0.01, 0.05})
    for (const int lone : {0, 2}) {
      SCOPED_TRACE(field_mm);
      SCOPED_TRACE(lone);
      double sum = 0;
      constexpr int kSeeds = 300;
      for (unsigned seed = 1; seed <= kSeeds; ++seed) {
        const Fitted fit = fitted(24, lone, field_mm, seed);
        const FieldVariance variance = field_variance(fit.patches, Matrix6(fit.held), 6);
        EXPECT_LE(variance.patches, 24 - 6 + 1e-9);
        EXPECT_GT(variance.patches, 6);
        sum += variance.mm2;
      }
      // Below 0 no variance is told: where there is none, the mean is a bit above it.
      EXPECT_NEAR(sum / kSeeds, field_mm * field_mm, 0.1 * field_mm * field_mm + 2e-6);
    }
}

TEST(PullOfField, ItsCovarianceHoldsTheErrorsOfDirectionsThatOnePatchAloneHolds) {
  int inside = 0;
  constexpr int kSeeds = 600;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Fitted fit = fitted(40, 1, 0.05, 1000 + seed);
    const FieldVariance variance = field_variance(fit.patches, Matrix6(fit.held), 6);
    const Mat6 pull = pull_of_field(fit.patches, variance.mm2, 1);
    const Mat6 covariance = fit.held + fit.held * pull * fit.held;
    // The direction that no residual shows.
    inside += fit.error[5] * fit.error[5] < 3.84 * covariance(5, 5);
  }
  EXPECT_NEAR(inside, 0.94 * kSeeds, 0.03 * kSeeds);
}

TEST(PullOfField, GrowsWithWhatPatchesShare) {
  Fitted fit = fitted(30, 0, 0.05, 7);
  const auto total = [&](double correlation_mm) {
    return Mat6(pull_of_field(fit.patches, 0.05 * 0.05, correlation_mm)).trace();
  };
  const double apart = total(1);
  for (ErrorPatch& patch : fit.patches) patch.pull = fit.patches[0].pull;
  const double alone = total(1);
  EXPECT_GT(total(1e5), 5 * alone);
  EXPECT_GT(apart, 0);
}

}  // namespace
}  // namespace tribin
