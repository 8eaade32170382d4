// Inverse kinematics over a million random poses of random arms: error, completeness, time.
// usage: campaign_kinematics [POSES]
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "support/arms.hpp"
#include "tribin/kinematics/inverse.hpp"

namespace {

using namespace tribin;
using robot::Arm;
using robot::ArmKind;
using robot::Joints;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void accuracy(ArmKind kind, int poses) {
  double worst = 0, worst_joint = 0;
  long solutions = 0;
  int judged = 0, found = 0;
  for (int seed = 1; seed <= poses; ++seed) {
    test::Random random(static_cast<unsigned>(seed));
    const Arm arm = test::random_arm(kind, random);
    const Joints truth = test::random_joints(arm, random);
    const Pose target = arm_from_flange(arm, truth);
    const auto all =
        kind == ArmKind::srs_7 ? inverse(arm, target, test::between(random, -kPi, kPi)) : inverse(arm, target);
    double nearest = 10;
    for (const Joints& joints : all) {
      worst = std::max(worst, test::relative_error(arm, arm_from_flange(arm, joints), target));
      nearest = std::min(nearest, test::difference(arm, joints, truth));
      ++solutions;
    }
    if (kind == ArmKind::srs_7) {
      ++judged;  // at any arm angle there are eight
      found += all.count == 8;
    } else if (margins(arm, truth).singularity > 1e-3) {
      ++judged;
      found += nearest < 1e-6;
      worst_joint = std::max(worst_joint, nearest < 1e-6 ? nearest : 0);
    }
  }
  std::printf("%d axes, %d poses of random arms: %ld solutions, worst relative error %.2g; ",
              kind == ArmKind::srs_7 ? 7 : 6, poses, solutions, worst);
  if (kind == ArmKind::srs_7)
    std::printf("8 solutions %d of %d\n", found, judged);
  else
    std::printf("true joints found %d of %d (away from singularities), within %.2g rad\n", found, judged, worst_joint);
}

void speed(const char* name, const Arm& arm) {
  constexpr int kPoses = 20000;
  std::vector<Pose> targets;
  test::Random random(1);
  for (int i = 0; i < kPoses; ++i) targets.push_back(arm_from_flange(arm, test::random_joints_in_limits(arm, random)));
  double best_inverse = 1e9, best_reach = 1e9;
  long count = 0, reached = 0;
  for (int run = 0; run < 5; ++run) {  // the least of five: other programs share the machine
    auto start = std::chrono::steady_clock::now();
    for (const Pose& target : targets)
      count += (arm.axes() == 7 ? inverse(arm, target, 0.5) : inverse(arm, target)).count;
    best_inverse = std::min(best_inverse, seconds_since(start));
    start = std::chrono::steady_clock::now();
    reached = 0;
    for (const Pose& target : targets) reached += reach(arm, target).has_value();
    best_reach = std::min(best_reach, seconds_since(start));
  }
  std::printf("%s: all solutions %.2f us, best with limits%s %.2f us, reached %ld of %d (%ld solutions)\n", name,
              best_inverse / kPoses * 1e6, arm.axes() == 7 ? " and arm-angle search" : "", best_reach / kPoses * 1e6,
              reached, kPoses, count / 5);
}

}  // namespace

int main(int argc, char** argv) {
  const int poses = argc > 1 ? std::atoi(argv[1]) : 1000000;
  speed("GP110", test::gp110());
  speed("SIA20D", test::sia20d());
  accuracy(ArmKind::spherical_wrist_6, poses);
  accuracy(ArmKind::srs_7, poses);
  return 0;
}
