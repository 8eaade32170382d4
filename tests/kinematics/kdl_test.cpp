// Agreement with Orocos KDL, whose chains are built here from the makers' drawings, not from our lengths.
#include <gtest/gtest.h>

#include "support/arms.hpp"
#include "tribin/kinematics/inverse.hpp"
#ifdef TRIBIN_HAS_KDL
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#endif

namespace tribin {
namespace {

#ifdef TRIBIN_HAS_KDL

Pose from_kdl(const KDL::Frame& frame) {
  Pose pose = Pose::Identity();
  for (int r = 0; r < 3; ++r) {
    pose.translation()[r] = frame.p[r];
    for (int c = 0; c < 3; ++c) pose.linear()(r, c) = frame.M(r, c);
  }
  return pose;
}

KDL::Frame to_kdl(const Pose& pose) {
  KDL::Frame frame;
  for (int r = 0; r < 3; ++r) {
    frame.p[r] = pose.translation()[r];
    for (int c = 0; c < 3; ++c) frame.M(r, c) = pose.linear()(r, c);
  }
  return frame;
}

/// A joint about an axis at an offset from the joint before, as URDF files have it.
void add(KDL::Chain& chain, const KDL::Vector& offset, const KDL::Vector& axis) {
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), KDL::Frame(offset)));
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Vector::Zero(), axis, KDL::Joint::RotAxis), KDL::Frame::Identity()));
}

KDL::Chain gp110_chain() {
  KDL::Chain chain;
  add(chain, {0, 0, 540}, {0, 0, 1});
  add(chain, {320, 0, 0}, {0, 1, 0});
  add(chain, {0, 0, 870}, {0, -1, 0});
  add(chain, {0, 0, 235}, {-1, 0, 0});
  add(chain, {1020, 0, 0}, {0, -1, 0});
  add(chain, {0, 0, 0}, {-1, 0, 0});
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None),
                                KDL::Frame(KDL::Rotation::RPY(kPi, -kPi / 2, 0), KDL::Vector(200, 0, 0))));
  return chain;
}

KDL::Chain sia20d_chain() {
  KDL::Chain chain;
  add(chain, {0, 0, 0}, {0, 0, 1});
  add(chain, {0, 0, 0}, {0, 1, 0});
  add(chain, {0, 0, 490}, {0, 0, 1});
  add(chain, {0, 0, 0}, {0, -1, 0});
  add(chain, {0, 0, 420}, {0, 0, -1});
  add(chain, {0, 0, 0}, {0, -1, 0});
  add(chain, {0, 0, 180}, {0, 0, -1});
  return chain;
}

void compare(const robot::Arm& arm, const KDL::Chain& chain) {
  KDL::ChainFkSolverPos_recursive forward(chain);
  Eigen::Matrix<double, 6, 1> weights;  // of its error: a radian counts as half a metre
  weights << 1, 1, 1, 500, 500, 500;
  KDL::ChainIkSolverPos_LMA inverse_solver(chain, weights);
  int solved = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const robot::Joints joints = test::random_joints_in_limits(arm, random);
    KDL::JntArray q(arm.axes());
    for (int i = 0; i < arm.axes(); ++i) q(i) = joints[i];
    KDL::Frame frame;
    forward.JntToCart(q, frame);
    const Pose target = arm_from_flange(arm, joints);
    ASSERT_LE(test::relative_error(arm, target, from_kdl(frame)), 1e-12);

    // What we find, KDL's own forward kinematics confirms; what KDL finds for six axes is among ours.
    const auto found = reach(arm, target);
    ASSERT_TRUE(found);
    for (int i = 0; i < arm.axes(); ++i) q(i) = found->joints[i];
    forward.JntToCart(q, frame);
    ASSERT_LE(test::relative_error(arm, target, from_kdl(frame)), 1e-9);
    if (arm.axes() != 6 || margins(arm, joints).singularity < 0.1) continue;
    KDL::JntArray start(6), answer(6);
    for (int i = 0; i < 6; ++i) start(i) = joints[i] + test::between(random, -0.3, 0.3);
    if (inverse_solver.CartToJnt(start, to_kdl(target), answer) != 0) continue;
    ++solved;
    robot::Joints theirs{};
    for (int i = 0; i < 6; ++i) theirs[i] = answer(i);
    double best = 10;
    for (const robot::Joints& ours : inverse(arm, target)) best = std::min(best, test::difference(arm, ours, theirs));
    EXPECT_LE(best, 1e-4);  // KDL stops at an error of 1e-5 mm, with more in the joints of an arm near a singularity
  }
  if (arm.axes() == 6) {
    EXPECT_GT(solved, 100);
  }
}

TEST(Kdl, AgreesOnTheGp110) { compare(test::gp110(), gp110_chain()); }
TEST(Kdl, AgreesOnTheSia20d) { compare(test::sia20d(), sia20d_chain()); }

#else

TEST(Kdl, Agrees) { GTEST_SKIP() << "Orocos KDL is not installed (liborocos-kdl-dev)"; }

#endif

}  // namespace
}  // namespace tribin
