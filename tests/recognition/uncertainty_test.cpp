#include <gtest/gtest.h>

#include "recognition/instance_report.hpp"

namespace tribin {
namespace {

TEST(Uncertainty, IsFiniteWhereWhatNothingHoldsIsAHairBelowZero) {
  Part part;
  part.diameter_mm = 87;
  part.gyration_mm = 27;
  Refinement refinement;
  refinement.camera_from_part.translation() = Eigen::Vector3d(10, -20, 700);
  refinement.rms_sigma = 1;
  // As sums over a million pixels leave it: a direction of no information, by a part in 1e12 of the best one below.
  refinement.information = Matrix6::Zero();
  refinement.information.diagonal() << 2e8, 3e7, 1e5, 8e4, 3e2, -0.3;
  const Eigen::Matrix<double, 6, 6> covariance = noise_covariance(part, refinement);
  ASSERT_TRUE(covariance.allFinite());
  // Held to a diameter at its radius of gyration, no better and no worse.
  EXPECT_NEAR(std::sqrt(covariance(5, 5)) * part.gyration_mm, part.diameter_mm, 0.01 * part.diameter_mm);
  EXPECT_NEAR(covariance(0, 0) * 2e8, 1, 1e-3);
}

}  // namespace
}  // namespace tribin
