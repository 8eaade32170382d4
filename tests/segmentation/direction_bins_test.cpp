#include "segmentation/direction_bins.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tribin::segmentation_detail {
namespace {

TEST(DirectionBins, FindsTheNearestBinWithinACellOfItsTable) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (const DirectionBins* bins : {&ijk_bins(), &axis_bins()})
    for (int trial = 0; trial < 2000; ++trial) {
      const Vec3f d = Vec3f(normal(random), normal(random), normal(random)).normalized();
      float best = 0;
      for (const Vec3f& c : bins->center) best = std::max(best, std::abs(c.dot(d)));
      const float ours = std::abs(bins->center[static_cast<std::size_t>(bins->find(d))].dot(d));
      EXPECT_LT(std::acos(std::min(1.0f, ours)) - std::acos(std::min(1.0f, best)), 2.0 * kDegree);
    }
}

TEST(DirectionBins, NeighboursAreAllWithinFiveDegrees) {
  const float limit = static_cast<float>(std::cos(5.0 * kDegree));
  for (const DirectionBins* bins : {&ijk_bins(), &axis_bins()})
    for (std::size_t i = 0; i < bins->center.size(); i += 7) {
      std::vector<std::uint32_t> truth;
      for (std::size_t j = 0; j < bins->center.size(); ++j)
        if (std::abs(bins->center[i].dot(bins->center[j])) > limit) truth.push_back(static_cast<std::uint32_t>(j));
      const auto ours = bins->neighbours(static_cast<int>(i));
      EXPECT_EQ(truth, std::vector<std::uint32_t>(ours.begin(), ours.end()));
    }
}

}  // namespace
}  // namespace tribin::segmentation_detail
