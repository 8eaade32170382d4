#include "tribin/picking/in_hand.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace tribin::picking {
namespace {

/// Errors as the model has them, drawn; what follows from them is what grip and looks see.
struct Drawn {
  explicit Drawn(unsigned seed) : random(seed) {}
  Vec3 vector(double rms) { return rms / std::sqrt(3.0) * Vec3(normal(random), normal(random), normal(random)); }
  Pose motion(double mm, double rad) {
    Pose pose = Pose::Identity();
    pose.translation() = vector(mm);
    pose.linear() = rotation_from_vector(vector(rad));
    return pose;
  }
  std::mt19937 random;
  std::normal_distribution<double> normal;
};

Pose pose_at(const Vec3& at, const Vec3& turn) {
  Pose pose = Pose::Identity();
  pose.translation() = at;
  pose.linear() = rotation_from_vector(turn);
  return pose;
}

constexpr double kRobot_mm = 0.3, kPose_mm = 0.15, kPose = 0.1 * kDegree;

struct Case {
  Gripper gripper;
  CellHandEye hand_eye;
  Vec3 camera_at = Vec3(1300, 0, 1100), middle = Vec3(10, -5, 40);
  Pose at_bin = pose_at(Vec3(1250, 80, 60), Vec3(kPi, 0, 0)),
       at_look = pose_at(Vec3(1300, 0, 450), Vec3(0, kPi / 2, 0));
  Pose tcp_from_part = pose_at(Vec3(3, -2, -30), Vec3(0.4, 2, 0.3));
  Matrix6 seen = Matrix6::Zero();

  Case() {
    gripper.kind = GripperKind::suction;
    hand_eye.sigma_mm = 0.25, hand_eye.sigma_rad = 0.02 * kDegree;
    seen.diagonal() << Vec3::Constant(kPose_mm * kPose_mm / 3), Vec3::Constant(kPose * kPose / 3);
  }

  /// \return  the errors of looks, grip and both together: of the middle [mm]
  std::array<double, 3> draw(unsigned seed, bool centred, double* chi2 = nullptr, Vec3* sigmas = nullptr) {
    Drawn drawn(seed);
    gripper.kind = centred ? GripperKind::parallel_outside : GripperKind::suction;
    // Hand-eye turns about the camera.
    const Vec3 eye_shift = drawn.vector(hand_eye.sigma_mm), eye_turn = drawn.vector(hand_eye.sigma_rad);
    const auto seen_by_camera = [&](const Pose& truth, bool sharp = false) {
      Vector6 delta;
      delta << eye_shift, eye_turn;
      Pose pose = moved_about(truth, camera_at, delta);
      if (sharp) return pose;
      delta << drawn.vector(kPose_mm), drawn.vector(kPose);
      return moved(pose, delta);
    };
    // The pose that was found is given, and with it the grip; what is true of the part follows backwards.
    const Pose found = at_bin * tcp_from_part;
    Pose true_part = found;
    for (int k = 0; k < 3; ++k) true_part = true_part * seen_by_camera(true_part, true).inverse() * found;
    Vector6 delta;
    delta << drawn.vector(kPose_mm), drawn.vector(kPose);
    true_part = moved(true_part, delta);
    Pose true_tcp = at_bin;
    true_tcp.translation() += drawn.vector(kRobot_mm);
    Pose held = true_tcp.inverse() * true_part;
    if (centred) held.translation().x() += (tcp_from_part * middle - held * middle).x();
    delta << drawn.vector(gripper.slip_mm), drawn.vector(kSlipTurn);
    held = moved_about(held, held * middle, delta);

    Pose tcp_there = at_look;
    tcp_there.translation() += drawn.vector(kRobot_mm);
    HandLook look;
    look.base_from_tcp = at_look;
    look.base_from_part = seen_by_camera(tcp_there * held);
    look.covariance = seen;
    const Grip grip{&gripper, at_bin, tcp_from_part, seen, true};
    const auto off = [&](const HeldPose& pose) { return (pose.tcp_from_part * middle - held * middle).norm(); };
    const auto estimate = [&](std::span<const HandLook> looks, bool believe) {
      return held_pose(grip, looks, hand_eye, camera_at, middle, kRobot_mm, believe);
    };
    const HeldPose looks = estimate(std::span(&look, 1), false), alone = estimate({}, true),
                   both = estimate(std::span(&look, 1), true);
    if (chi2) *chi2 = both.chi2;
    if (sigmas) *sigmas = Vec3(looks.sigma_mm(), alone.sigma_mm(), both.sigma_mm());
    return {off(looks), off(alone), off(both)};
  }
};

TEST(HeldPose, IsAsSureAsItSaysAndBetterThanGripOrLooksAlone) {
  for (const bool centred : {false, true}) {
    SCOPED_TRACE(centred);
    Case all;
    constexpr unsigned kDraws = 2000;
    Vec3 squares = Vec3::Zero(), sigmas;
    double chi2 = 0, mean_chi2 = 0;
    for (unsigned seed = 1; seed <= kDraws; ++seed) {
      const auto off = all.draw(seed, centred, &chi2, &sigmas);
      for (int k = 0; k < 3; ++k) squares[k] += off[static_cast<std::size_t>(k)] * off[static_cast<std::size_t>(k)];
      mean_chi2 += chi2 / kDraws;
    }
    const Vec3 rms = (squares / kDraws).cwiseSqrt();
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(rms[k], sigmas[k], 0.05 * sigmas[k]) << k;
    EXPECT_LT(rms[2], 0.95 * rms[0]);
    EXPECT_LT(rms[2], 0.95 * rms[1]);
    EXPECT_NEAR(mean_chi2, 6, 0.4);
  }
}

TEST(HeldPose, LooksFromBothSidesTakeAwayWhatIsOffThere) {
  Case all;
  HandLook there;
  there.base_from_tcp = all.at_look;
  there.base_from_part = all.at_look * all.tcp_from_part;
  there.covariance = all.seen;
  HandLook turned = there;  // about the tool, by half a turn
  turned.base_from_tcp = all.at_look * pose_at(Vec3::Zero(), Vec3(0, 0, kPi));
  turned.base_from_part = turned.base_from_tcp * all.tcp_from_part;
  const Grip grip{&all.gripper, all.at_bin, all.tcp_from_part, all.seen, true};
  const std::array<HandLook, 2> looks = {there, turned};
  const auto estimate = [&](std::span<const HandLook> of) {
    return held_pose(grip, of, all.hand_eye, all.camera_at, all.middle, kRobot_mm, false);
  };
  const HeldPose one = estimate(std::span(looks).first(1)), both = estimate(looks);
  for (int k = 0; k < 2; ++k) EXPECT_LT(both.covariance(k, k), 0.3 * one.covariance(k, k));
  EXPECT_GT(both.covariance(2, 2), 0.5 * one.covariance(2, 2));  // along the tool nothing turns over
}

TEST(HeldPose, AFreeDirectionIsNotTurned) {
  Case all;
  HandLook look;
  look.base_from_tcp = all.at_look;
  const Vec3 axis = all.at_look.linear() * all.tcp_from_part.linear().col(2);
  look.base_from_part = all.at_look * all.tcp_from_part * pose_at(Vec3::Zero(), Vec3(0, 0, 0.5));
  look.covariance = all.seen;
  Vector6 free;
  free << Vec3::Zero(), axis;
  look.free_directions = {free};
  all.middle = Vec3(0, 0, 40);
  const Grip grip{&all.gripper, all.at_bin, all.tcp_from_part, all.seen, true};
  const HeldPose pose = held_pose(grip, std::span(&look, 1), all.hand_eye, all.camera_at, all.middle, kRobot_mm);
  EXPECT_LT(rotation_angle(pose.tcp_from_part.linear(), all.tcp_from_part.linear()), 1e-6);
  EXPECT_LT(pose.chi2, 1e-6);
}

}  // namespace
}  // namespace tribin::picking
