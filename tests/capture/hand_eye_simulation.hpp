#pragma once

#include <vector>

#include "sim/random.hpp"
#include "tribin/capture/hand_eye.hpp"

namespace tribin::test {

/// A cell with a camera, and the stops of a robot in it.
struct HandEyeSimulation {
  std::vector<HandEyePair> pairs;
  Pose parent_from_camera = Pose::Identity();
  Pose holder_from_target = Pose::Identity();
};

struct HandEyeSimulationOptions {
  CameraMount mount = CameraMount::fixed;
  int poses = 12;
  double tilt_sd = 30 * kDegree;  ///< about x and y
  double yaw_sd = 60 * kDegree;   ///< about the view's axis
  HandEyeNoise noise = {};        ///< drawn; 0 = none
};

inline Pose pose_of(const Matrix3& rotation, const Vec3& translation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = translation;
  return pose;
}

/// Gaussian in each axis, (dt, w) in the target frame's axes: R' = Exp(w) R.
inline Pose noisy(const Pose& pose, double mm, double rad, sim::Random& random) {
  Vector6 d;
  for (int k = 0; k < 6; ++k) d[k] = random.normal() * (k < 3 ? mm : rad);
  return moved(pose, d);
}

/// The target stays about 800 mm before the camera, within +-150 mm, tilted and turned at random.
inline HandEyeSimulation simulate_hand_eye(unsigned seed, const HandEyeSimulationOptions& options = {}) {
  sim::Random random(seed);
  const auto vector = [&](double sd) { return Vec3(sd * random.normal(), sd * random.normal(), sd * random.normal()); };
  HandEyeSimulation out;
  const bool fixed = options.mount == CameraMount::fixed;
  out.parent_from_camera =
      fixed ? pose_of(rotation_from_vector(Vec3(kPi, 0, 0)) * rotation_from_vector(vector(0.2)), Vec3(700, 100, 1300))
            : pose_of(rotation_from_vector(vector(0.3)), Vec3(60, -20, 90) + vector(10));
  out.holder_from_target =
      fixed ? pose_of(rotation_from_vector(vector(0.3)), Vec3(20, -30, 150) + vector(20))
            : pose_of(rotation_from_vector(Vec3(kPi, 0, 0)) * rotation_from_vector(vector(0.2)), Vec3(800, 50, 20));
  for (int i = 0; i < options.poses; ++i) {
    const Matrix3 turn =
        rotation_from_vector(Vec3(0, 0, options.yaw_sd * random.normal())) *
        rotation_from_vector(Vec3(options.tilt_sd * random.normal(), options.tilt_sd * random.normal(), 0));
    const Vec3 place(random.uniform(-150, 150), random.uniform(-150, 150), random.uniform(700, 900));
    const Pose camera_from_target = pose_of(turn, place);
    const Pose a = out.parent_from_camera * camera_from_target * out.holder_from_target.inverse();
    HandEyePair pair{std::to_string(i + 1), fixed ? a : a.inverse(), camera_from_target};
    pair.base_from_flange = noisy(pair.base_from_flange, options.noise.robot_mm, options.noise.robot_rad, random);
    pair.camera_from_target = noisy(pair.camera_from_target, options.noise.camera_mm, options.noise.camera_rad, random);
    out.pairs.push_back(pair);
  }
  return out;
}

}  // namespace tribin::test
