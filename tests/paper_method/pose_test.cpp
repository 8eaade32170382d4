#include "tribin/paper_method/pose.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tribin/paper_method/tests.hpp"

namespace tribin::paper {
namespace {

struct Random {
  std::mt19937 generator;
  explicit Random(unsigned seed) : generator(seed) {}
  double operator()(double low, double high) {
    return low + (high - low) * (generator() / 4294967296.0);  // the same numbers with any library
  }
  Vec3 direction() { return Vec3((*this)(-1, 1), (*this)(-1, 1), (*this)(0.1, 1)).normalized(); }
  Vec3 place() { return {(*this)(-50, 50), (*this)(-50, 50), (*this)(-50, 50)}; }
  Pose pose() {
    Pose out = Pose::Identity();
    out.linear() = rotation_from_vector((*this)(0, 3) * direction());
    out.translation() = place();
    return out;
  }
};

Primitive random_cylinder(Random& random) {
  Primitive p;
  p.type = PrimitiveType::cylinder;
  p.axis = random.direction();
  p.point = random.place();
  p.radius_mm = random(5, 60);
  p.extent_min = -random(5, 40);
  p.extent_max = random(5, 40);
  return p;
}

Primitive random_plane(Random& random) {
  Primitive p;
  p.axis = random.direction();
  p.point = random.place();
  p.offset_mm = p.axis.dot(p.point);
  return p;
}

Primitive moved(const Primitive& p, const Pose& pose) {
  Primitive out = p;
  out.axis = pose.linear() * p.axis;
  out.point = pose * p.point;
  out.offset_mm = out.axis.dot(pose * Vec3(p.offset_mm * p.axis));
  return out;
}

TEST(Superquadric, IsOneOnTheIdealCylinderAndMoreOutside) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const double r = random(1, 60), h = random(1, 100), angle = random(0, 2 * kPi), z = random(-0.4, 0.4) * h;
    const Vec3 on(r * std::cos(angle), r * std::sin(angle), z);
    EXPECT_NEAR(superquadric_of_cylinder(on, r, h), 1, 0.005);  // 0.4 h is near the rounded rim
    EXPECT_NEAR(superquadric_of_cylinder({on.x(), on.y(), 0}, r, h), 1, 1e-12);
    EXPECT_NEAR(superquadric_of_cylinder({0, 0, 0.5 * h}, r, h), 1, 1e-12);  // the end cap
    EXPECT_NEAR(superquadric_of_cylinder(1.3 * on, r, h), 1.3 * superquadric_of_cylinder(on, r, h), 1e-9);
    EXPECT_LE(superquadric_of_cylinder({on.x(), on.y(), 0.5 * h}, r, h), std::pow(2, 0.05) + 1e-12);
  }
}

TEST(FrameOf, IsARotationWithV1First) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Vec3 v1 = random.direction();
    const Matrix3 frame = frame_of(v1, 7 * random.direction());
    EXPECT_LT((frame.transpose() * frame - Matrix3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(frame.determinant(), 1, 1e-12);
    EXPECT_LT((frame.col(0) - v1).norm(), 1e-12);
    EXPECT_LT((frame.col(1) - frame.col(2).cross(frame.col(0))).norm(), 1e-12);
  }
}

TEST(IntersectionPoints, LieOnBothSurfacesAndMoveWithThem) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Primitive cylinder = random_cylinder(random);
    Primitive plane = random_plane(random);
    if (seed % 2) {  // along the axis, cutting the cylinder
      Vec3 u, v;
      orthonormal_basis(cylinder.axis, u, v);
      plane.axis = u;
      plane.offset_mm = u.dot(cylinder.point) + random(-0.9, 0.9) * cylinder.radius_mm;
    }
    if (!(seed % 2) && std::abs(plane.axis.dot(cylinder.axis)) < std::sin(15 * kDegree)) continue;
    const Matrix3 frame = frame_of(cylinder.axis, random.direction());
    const auto points = intersection_points(cylinder, plane, frame);
    for (const Vec3& p : points) {
      EXPECT_NEAR(plane.axis.dot(p), plane.offset_mm, 1e-9);
      EXPECT_NEAR(across(cylinder.point, p, cylinder.axis).norm(), cylinder.radius_mm, 1e-9);
    }
    const Pose pose = random.pose();
    Primitive turned = moved(cylinder, pose);
    if (seed % 3 == 0) {  // the same cylinder, its axis told the other way round
      turned.axis = -turned.axis;
      std::swap(turned.extent_min, turned.extent_max);
      turned.extent_min = -turned.extent_min, turned.extent_max = -turned.extent_max;
    }
    const auto there = intersection_points(turned, moved(plane, pose), pose.linear() * frame);
    for (int k = 0; k < 4; ++k) EXPECT_LT((there[k] - pose * points[k]).norm(), 1e-9);
  }
}

TEST(IcpTranslation, FindsTheShiftOfACloud) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const Pose truth = random.pose();
    std::vector<Vec3f> model, seen;
    for (int i = 0; i < 300; ++i) model.push_back(random.place().cast<float>());
    for (int i = 0; i < 300; i += 3) seen.push_back((truth * model[i].cast<double>()).cast<float>());
    const Vec3 start = truth.translation() + random.direction();  // 1 mm off: the points are some 15 mm apart
    const Icp icp = icp_translation(seen, model, truth.linear(), start, 60);
    EXPECT_LT((icp.translation - truth.translation()).norm(), 0.02);
    EXPECT_LT(icp.mean_distance_mm, 0.02);
    EXPECT_LT(icp.mean_distance_mm, icp_translation(seen, model, truth.linear(), start, 0).mean_distance_mm);
  }
}

TEST(AxisOffset, TellsCoaxialFromParallel) {
  Random random(5);
  Primitive main = random_cylinder(random);
  for (int i = 0; i < 4; ++i) main.covariance(i, i) = 1e-6;
  Primitive sub = main;
  sub.point += 30 * main.axis;
  EXPECT_FALSE(axis_offset(main, sub).passed);
  Vec3 u, v;
  orthonormal_basis(main.axis, u, v);
  sub.point += 0.1 * main.radius_mm * u;
  EXPECT_TRUE(axis_offset(main, sub).passed);
  EXPECT_NEAR(axis_offset(main, sub).value, 0.1 * main.radius_mm, 1e-9);
}

TEST(PaperTests, HoldBetweenAModelAndItselfInAnyPose) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Primitive main = random_cylinder(random), sub = random_cylinder(random);
    main.arc = sub.arc = 2 * kPi;
    main.area_mm2 = sub.area_mm2 = 1000;
    Primitive plane = random_plane(random), other = random_plane(random);
    plane.area_mm2 = 300;
    const Pose pose = random.pose();
    const Primitive main2 = moved(main, pose), sub2 = moved(sub, pose), plane2 = moved(plane, pose);
    EXPECT_TRUE(cylinder_radius(main2, main).passed);
    EXPECT_TRUE(cylinder_height(main2, main).passed);
    EXPECT_TRUE(cylinder_distance(main2, sub2, main, sub, 100).passed);
    EXPECT_TRUE(cylinder_angle(main2, sub2, main, sub).passed);
    EXPECT_TRUE(plane_to_cylinder(plane2.axis, main2.axis, plane.axis, main.axis).passed);
    EXPECT_TRUE(plane_plane_angle(plane2.axis, pose.linear() * other.axis, plane.axis, other.axis).passed);
    EXPECT_NEAR(area_similarity(plane2, main2, plane, main).value, 1, 1e-9);
  }
}

TEST(PaperTests, RefuseWhatDiffersByMoreThanTheLimit) {
  Random random(9);
  const Primitive model = random_cylinder(random);
  Primitive seen = model;
  seen.radius_mm *= 1.03;
  EXPECT_FALSE(cylinder_radius(seen, model).passed);
  seen = model;
  seen.extent_max = seen.extent_min + 0.4 * model.height_mm();
  EXPECT_FALSE(cylinder_height(seen, model).passed);
  EXPECT_FALSE(largest_cylinder(model, model.radius_mm * 1.1).passed);
  EXPECT_FALSE(plane_on_cylinder(0).passed);
  EXPECT_FALSE(intersected_planes(3, 2).passed);
  EXPECT_FALSE(shared_planes(1, 0).passed);
  EXPECT_FALSE(icp_distance(2.6, 100).passed);
}

}  // namespace
}  // namespace tribin::paper
