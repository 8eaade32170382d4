#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tribin/core/geometry.hpp"

namespace tribin {

/// Two oriented points as one of them sees the other, whatever the pose: their distance and three angles in one number,
/// and the angle about the first one's normal at which the second lies.
struct PointPair {
  std::uint32_t key = 0;
  float turn = 0;  ///< [rad], from u of orthonormal_basis(normal of the first)
};

/// Steps of a pair's key: 5 % of the part's diameter and 12 deg.
/// \source B. Drost, M. Ulrich, N. Navab, S. Ilic, "Model globally, match locally", CVPR 2010: 5 % and 30 steps.
class PointPairSteps {
 public:
  explicit PointPairSteps(double diameter_mm);
  /// Nothing for a pair that is further apart than the diameter or in one place.
  std::optional<PointPair> pair(const Vec3f& p, const Vec3f& n, const Vec3f& u, const Vec3f& v, const Vec3f& q,
                                const Vec3f& m) const;
  std::uint32_t keys() const;

 private:
  float inverse_step_;
};

/// All pairs of a part's points by their key.
/// \source as PointPairSteps.
class PointPairTable {
 public:
  struct Entry {
    std::uint16_t point = 0;  ///< the first of the pair
    std::uint8_t turn = 0;    ///< kTurns steps
  };
  static constexpr int kTurns = 32;

  PointPairTable(std::span<const Vec3f> points, std::span<const Vec3f> normals, double diameter_mm);
  std::span<const Entry> with(std::uint32_t key) const {
    return {entries_.data() + first_[key], entries_.data() + first_[key + 1]};
  }
  const PointPairSteps& steps() const { return steps_; }

 private:
  PointPairSteps steps_;
  std::vector<std::uint32_t> first_;
  std::vector<Entry> entries_;
};

}  // namespace tribin
