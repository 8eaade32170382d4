#include "sim/cell_errors.hpp"

#include <cmath>

#include "sim/random.hpp"

namespace tribin::sim {
namespace {

Vec3 drawn_vector(double rms, Random& random) {
  const double sigma = rms / std::sqrt(3.0);
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return sigma * Vec3(x, y, z);
}

}  // namespace

Pose drawn_motion(double mm, double rad, Random& random) {
  Pose pose = Pose::Identity();
  pose.translation() = drawn_vector(mm, random);
  pose.linear() = rotation_from_vector(drawn_vector(rad, random));
  return pose;
}

RobotField::RobotField(double rms_mm, std::uint64_t seed) {
  Random random(mixed(seed) ^ 0xF1E1Du);
  for (Wave& wave : waves_) {
    // Gear and link errors change over the reach of an arm, not over millimetres.
    const double length_mm = random.uniform(600, 2500);
    wave.amplitude = drawn_vector(rms_mm * std::sqrt(2.0 / static_cast<double>(waves_.size())), random);
    wave.number = drawn_vector(1, random).normalized() * (2 * kPi / length_mm);
    wave.phase = random.uniform(0, 2 * kPi);
  }
}

Vec3 RobotField::error_at(const Vec3& point) const {
  Vec3 error = Vec3::Zero();
  for (const Wave& wave : waves_) error += std::sin(wave.number.dot(point) + wave.phase) * wave.amplitude;
  return error;
}

}  // namespace tribin::sim
