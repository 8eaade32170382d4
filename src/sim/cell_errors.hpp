#pragma once

#include <array>
#include <cstdint>

#include "tribin/core/geometry.hpp"

namespace tribin::sim {

class Random;

/// A rotation and a shift drawn from normal distributions, evenly in all directions. \param mm, rad  root mean squares
/// of their lengths
Pose drawn_motion(double mm, double rad, Random& random);

/// Where an arm really stands: off by a smooth field over the cell.
class RobotField {
 public:
  /// \param rms_mm  of the length of the error, over places and seeds
  RobotField(double rms_mm, std::uint64_t seed);
  Vec3 error_at(const Vec3& base_point) const;

 private:
  struct Wave {
    Vec3 amplitude, number;  ///< [mm], [rad/mm]
    double phase;
  };
  std::array<Wave, 4> waves_;
};

}  // namespace tribin::sim
