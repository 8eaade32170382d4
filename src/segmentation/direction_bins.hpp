#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin::segmentation_detail {

/// Equal-area bins of the half sphere (n and -n are one direction): IJK space and the directions of parameter space.
struct DirectionBins {
  std::vector<Vec3f> center;              ///< golden spiral, z >= 0
  std::vector<std::uint32_t> near_begin;  ///< CSR of `near`
  std::vector<std::uint32_t> near;        ///< bins within 5 deg, itself included
  std::vector<std::uint16_t> table;       ///< octahedral map of the half sphere -> nearest bin

  int find(const Vec3f& direction) const;  ///< the bin whose centre is nearest to +-direction
  std::span<const std::uint32_t> neighbours(int bin) const {
    return {near.data() + near_begin[bin], near.data() + near_begin[bin + 1]};
  }
};

inline constexpr int kIjkBins = 4096;        // 2.2 deg apart: planes
inline constexpr int kParameterBins = 2048;  // 3.2 deg apart: axes

const DirectionBins& ijk_bins();
const DirectionBins& axis_bins();

}  // namespace tribin::segmentation_detail
