#pragma once

#include <string>

#include "tribin/eval/eval.hpp"
#include "tribin/finder/finder.hpp"

namespace tribin {

// The few numbers and words that the command line's table and the report's page share.

/// Yaskawa's Rx, Ry, Rz [rad]: R = Rz Ry Rx; at gimbal lock Rx = 0.
Vec3 yaskawa_angles(const Matrix3& rotation);

/// One standard deviation of a pose, each along its worst axis; free directions count as known.
struct PoseSigma {
  double translation_mm = 0;  ///< at the point `at` of the part
  double rotation = 0;        ///< [rad]
};
/// \param at  point of the part, part frame [mm]: the centre of its box, mostly.
PoseSigma pose_sigma(const Instance& instance, const Vec3& at);

/// The answer in one sentence: "2 parts found: alternator_a and alternator_b", or what is there instead.
std::string verdict(const Found& found, std::span<const Part> parts);

}  // namespace tribin
