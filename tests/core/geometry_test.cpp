#include "tribin/core/geometry.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tribin {
namespace {

TEST(Geometry, RotationVectorsComeBack) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(i);
    const Vec3 w = Vec3(uniform(random), uniform(random), uniform(random)) * 1.8;
    const Vec3 back = vector_from_rotation(rotation_from_vector(w));
    EXPECT_LT((back - w).norm(), 1e-9) << w.transpose();
    EXPECT_NEAR(rotation_angle(Matrix3::Identity(), rotation_from_vector(w)), w.norm(), 1e-9);
  }
}

TEST(Geometry, BasisIsRightHandedForEveryAxis) {
  for (const Vec3& axis : {Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(0.6, 0, -0.8), Vec3(0, -1, 0)}) {
    Vec3 u, v;
    orthonormal_basis(axis, u, v);
    EXPECT_LT((Eigen::Vector3d(u).cross(Eigen::Vector3d(v)) - axis).norm(), 1e-12);
    EXPECT_NEAR(u.dot(v), 0, 1e-12);
  }
}

}  // namespace
}  // namespace tribin
