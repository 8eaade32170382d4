#include "tribin/kinematics/rotation_conventions.hpp"

#include <gtest/gtest.h>

#include "sim/random.hpp"
#include "tribin/core/error.hpp"

namespace tribin::robot {
namespace {

// Nine printed digits.
constexpr double kPrinted = 1e-9;

Matrix3 golden_rotation() {
  Matrix3 r;
  r << 0.813797681, -0.440969611, 0.378522306,  //
      0.469846310, 0.882564119, 0.018028311,    //
      -0.342020143, 0.163175911, 0.925416578;
  return r;
}

/// All of SO(3) alike.
Matrix3 any_rotation(sim::Random& random) {
  Eigen::Quaterniond q(random.normal(), random.normal(), random.normal(), random.normal());
  return q.normalized().toRotationMatrix();
}

double rotation_error(const Matrix3& a, const Matrix3& b) { return (a - b).cwiseAbs().maxCoeff(); }

Pose with_rotation(const Matrix3& rotation, const Vec3& position) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = position;
  return pose;
}

double round_trip_error(const Matrix3& rotation) {
  double worst = 0;
  const Pose pose = with_rotation(rotation, {123.4, -56.7, 890.1});
  for (Convention convention : kConventions) {
    const Pose back = pose_from_numbers(convention, numbers_from_pose(convention, pose));
    worst = std::max(worst, rotation_error(Matrix3(back.linear()), rotation));
    worst = std::max(worst, (back.translation() - pose.translation()).cwiseAbs().maxCoeff() / 1000);
  }
  return worst;
}

TEST(RotationConventions, GoldenVectorOfTheContract) {
  const Matrix3 r = golden_rotation();
  const Vec3 angles(10, 20, 30), kawasaki(2.726830, 22.268744, 25.505550), ur(0.077525317, 0.384851569, 0.486479230);
  const Vec4 xyzw(0.038134576, 0.189307857, 0.239298338, 0.951548525);
  const Vec4 wxyz(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  EXPECT_LT(rotation_error(rotation_from_yaskawa(angles), r), kPrinted);
  EXPECT_LT(rotation_error(rotation_from_fanuc(angles), r), kPrinted);
  EXPECT_LT(rotation_error(rotation_from_kuka({30, 20, 10}), r), kPrinted);
  EXPECT_LT(rotation_error(rotation_from_mitsubishi(angles), r), kPrinted);
  EXPECT_LT(rotation_error(rotation_from_kawasaki(kawasaki), r), 2e-8);  // six printed digits of a degree
  EXPECT_LT(rotation_error(rotation_from_abb(wxyz), r), 3 * kPrinted);
  EXPECT_LT(rotation_error(rotation_from_ur(ur), r), 3 * kPrinted);
  EXPECT_LT(rotation_error(rotation_from_ros(xyzw), r), 3 * kPrinted);

  const Matrix3 exact = rotation_from_yaskawa(angles);
  EXPECT_LT((yaskawa_from_rotation(exact) - angles).norm(), 1e-12);
  EXPECT_LT((fanuc_from_rotation(exact) - angles).norm(), 1e-12);
  EXPECT_LT((kuka_from_rotation(exact) - Vec3(30, 20, 10)).norm(), 1e-12);
  EXPECT_LT((mitsubishi_from_rotation(exact) - angles).norm(), 1e-12);
  EXPECT_LT((kawasaki_from_rotation(exact) - kawasaki).norm(), 1e-6);
  EXPECT_LT((abb_from_rotation(exact) - wxyz).norm(), 2 * kPrinted);
  EXPECT_LT((ur_from_rotation(exact) - ur).norm(), 2 * kPrinted);
  EXPECT_LT((ros_from_rotation(exact) - xyzw).norm(), 2 * kPrinted);
}

TEST(RotationConventions, EveryRotationComesBack) {
  for (unsigned seed = 1; seed <= 20000; ++seed) {
    sim::Random random(seed);
    ASSERT_LT(round_trip_error(any_rotation(random)), 5e-15 * 10) << "seed " << seed;
  }
}

TEST(RotationConventions, EveryRotationComesBackAtAndNearGimbalLock) {
  for (unsigned seed = 1; seed <= 4000; ++seed) {
    SCOPED_TRACE(seed);
    sim::Random random(seed);
    const double x = random.uniform(-180, 180), z = random.uniform(-180, 180);
    const double off = seed % 4 == 0 ? 0 : random.normal() * std::pow(10.0, -random.integer(1, 14));
    for (double middle : {-90.0, 90.0}) {
      const Matrix3 r = rotation_from_yaskawa({x, middle + off, z});
      ASSERT_LT(round_trip_error(r), 3e-9);  // inside the lock's threshold the rest of the turn is given up
      if (off != 0) continue;
      EXPECT_EQ(yaskawa_from_rotation(r).x(), 0);
      EXPECT_EQ(kuka_from_rotation(r).z(), 0);
      EXPECT_LT(round_trip_error(r), 5e-14);
    }
    for (double middle : {0.0, 180.0}) {
      const Matrix3 r = rotation_from_kawasaki({x, middle + off, z});
      ASSERT_LT(round_trip_error(r), 3e-9);
      if (off == 0) EXPECT_EQ(kawasaki_from_rotation(r).z(), 0);
    }
  }
}

TEST(RotationConventions, OneRotationHasOneSetOfNumbers) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    sim::Random random(seed);
    const Matrix3 r = any_rotation(random);
    const Vec3 angles = yaskawa_from_rotation(r);
    EXPECT_LE(std::abs(angles.y()), 90);
    EXPECT_GE(kawasaki_from_rotation(r).y(), 0);
    EXPECT_GE(abb_from_rotation(r)[0], 0);
    EXPECT_LE(ur_from_rotation(r).norm(), kPi + 1e-12);
    // The other set of angles of the same rotation.
    const Matrix3 same = rotation_from_yaskawa({angles.x() + 180, 180 - angles.y(), angles.z() + 180});
    EXPECT_LT((yaskawa_from_rotation(same) - angles).norm(), 1e-9);
    EXPECT_LT(rotation_error(rotation_from_abb(-abb_from_rotation(r)), r), 1e-14);
  }
  EXPECT_EQ(yaskawa_from_rotation(rotation_from_yaskawa({-180, 0, 0})).x(), 180);
}

TEST(RotationConventions, RosSpeaksInMetres) {
  const Pose pose = with_rotation(Matrix3::Identity(), {1500, -20, 300});
  EXPECT_EQ(numbers_from_pose(Convention::ros, pose), (std::vector<double>{1.5, -0.02, 0.3, 0, 0, 0, 1}));
  EXPECT_EQ(numbers_from_pose(Convention::abb, pose), (std::vector<double>{1500, -20, 300, 1, 0, 0, 0}));
}

TEST(RotationConventions, NamesComeBackAndAnUnknownOneIsAnError) {
  for (Convention convention : kConventions) EXPECT_EQ(convention_from_name(name_of(convention)), convention);
  try {
    convention_from_name("acme");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_NE(std::string(e.what()).find("kawasaki"), std::string::npos);
  }
}

}  // namespace
}  // namespace tribin::robot
