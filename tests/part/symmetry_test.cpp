#include "tribin/part/symmetry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "part/shapes.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using test::box;
using test::moved;
using test::plate_with_hole;
using test::random_pose;
using test::rectangle;
using test::regular_polygon;
using test::turned;

/// The smallest difference of a pose to the members of a group, at `reach` mm from the origin.
double distance_to_group(const Pose& pose, const SymmetryGroup& group, double reach) {
  double least = std::numeric_limits<double>::max();
  for (const Pose& g : group.discrete)
    least = std::min(least,
                     rotation_angle(pose.linear(), g.linear()) * reach + (pose.translation() - g.translation()).norm());
  return least;
}

void expect_is_group(const SymmetryGroup& group, double reach) {
  ASSERT_FALSE(group.discrete.empty());
  EXPECT_TRUE(group.discrete.front().isApprox(Pose::Identity()));
  for (const Pose& a : group.discrete)
    for (const Pose& b : group.discrete) EXPECT_LT(distance_to_group(a * b, group, reach), 1e-3 * reach);
}

TEST(FindSymmetries, CountsTheRotationsOfPolyhedraWhereverTheyLie) {
  const struct {
    const char* name;
    Mesh mesh;
    std::size_t order;
  } cases[] = {
      {"box with three different sides", box(60, 40, 25), 4},
      {"square prism", box(40, 40, 70), 8},
      {"flat square prism", box(60, 60, 9), 8},
      {"cube", box(50, 50, 50), 24},
      {"triangular prism", turned({{20, 0}, {20, 30}}, 3), 6},
      {"hexagonal prism", turned({{20, 0}, {20, 30}}, 6), 12},
      {"hexagonal pyramid stump", turned({{20, 0}, {12, 30}}, 6), 6},
      {"flat five-sided prism", turned({{20, 0}, {20, 9}}, 5), 10},
  };
  for (const auto& c : cases)
    for (unsigned seed = 0; seed < 4; ++seed) {
      SCOPED_TRACE(c.name);
      SCOPED_TRACE(seed);
      const auto found = find_symmetries(seed == 0 ? c.mesh : moved(c.mesh, random_pose(seed)));
      EXPECT_EQ(found.group.discrete.size(), c.order);
      EXPECT_TRUE(found.group.continuous.empty());
      expect_is_group(found.group, 50);
    }
}

TEST(FindSymmetries, FacetsDoNotBreakRoundness) {
  for (const int facets : {16, 26, 60, 181}) {
    SCOPED_TRACE(facets);
    const Pose pose = random_pose(facets);
    const auto axis_error_deg = [&](const SymmetryGroup& group) {
      return std::acos(std::min(1.0, std::abs(group.continuous.at(0).axis.dot(pose.linear().col(2))))) / kDegree;
    };
    const auto cylinder = find_symmetries(moved(turned({{20, 0}, {20, 50}}, facets), pose)).group;
    ASSERT_EQ(cylinder.continuous.size(), 1u);
    EXPECT_EQ(cylinder.discrete.size(), 2u) << "a half turn swaps the ends";
    EXPECT_LT(axis_error_deg(cylinder), 0.1);
    const auto cone = find_symmetries(moved(turned({{20, 0}, {8, 50}}, facets), pose)).group;
    ASSERT_EQ(cone.continuous.size(), 1u);
    EXPECT_EQ(cone.discrete.size(), 1u);
    EXPECT_LT(axis_error_deg(cone), 0.1);
    const Mesh steps = turned({{8, 0}, {8, 30}, {20, 30}, {20, 44}, {6, 44}, {6, 60}}, facets);
    const auto shaft = find_symmetries(moved(steps, pose)).group;
    ASSERT_EQ(shaft.continuous.size(), 1u);
    EXPECT_EQ(shaft.discrete.size(), 1u);
    const ContinuousSymmetry& c = shaft.continuous.front();
    EXPECT_LT((pose.translation() - c.point).cross(c.axis).norm(), 0.05) << "the axis goes through its place";
  }
}

TEST(FindSymmetries, BallIsThreeAxes) {
  std::vector<std::array<double, 2>> profile;
  for (int i = 1; i < 40; ++i) profile.push_back({20 * std::sin(kPi * i / 40), -20 * std::cos(kPi * i / 40)});
  EXPECT_EQ(find_symmetries(turned(profile, 80)).group.continuous.size(), 3u);
}

TEST(FindSymmetries, HoleOffTheMiddleLeavesSelfSimilarPoses) {
  const Vec2 hole(22, 6);
  const Vec3 middle(0, 0, 6);  // of the plate: the hole has its centroid off this
  const Mesh mesh = plate_with_hole(rectangle(40, 25), 12, hole, 3);
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const Pose pose = seed == 0 ? Pose::Identity() : random_pose(seed);
    const auto found = find_symmetries(moved(mesh, pose));
    EXPECT_EQ(found.group.discrete.size(), 1u);
    for (int k = 0; k < 3; ++k) {
      Pose half = Pose::Identity();
      half.linear() = rotation_from_vector(kPi * Vec3::Unit(k));
      half.translation() = middle - half.linear() * middle;
      const Pose wanted = pose * half * pose.inverse();
      const auto it = std::find_if(found.self_similar.begin(), found.self_similar.end(), [&](const SelfSimilarPose& s) {
        return rotation_angle(s.part_from_part.linear(), wanted.linear()) < 0.3 * kDegree &&
               (s.part_from_part * (pose * middle) - pose * middle).norm() < 0.1;
      });
      ASSERT_NE(it, found.self_similar.end()) << "half turn about axis " << k;
      EXPECT_GT(it->overlap, 0.9);
      EXPECT_LT(it->overlap, 0.99);
      EXPECT_GT(it->discriminating_points.size(), 50u);
      for (const Vec3f& p : it->discriminating_points) {
        const Vec3 q = pose.inverse() * p.cast<double>();
        const Vec3 image = half * q;
        const double to_hole = std::min((Vec2(q.x(), q.y()) - hole).norm(), (Vec2(image.x(), image.y()) - hole).norm());
        EXPECT_LT(to_hole, 3 + found.telling_mm) << "at the hole, or where the moved plate has it";
      }
    }
  }
}

TEST(FindSymmetries, BestSelfSimilarPosesComeFirstAndWithinTheCap) {
  SymmetryOptions options;
  options.max_self_similar = 3;
  const auto found = find_symmetries(plate_with_hole(regular_polygon(4, 40), 10, {9, 4}, 4), options);
  ASSERT_EQ(found.self_similar.size(), 3u);
  for (std::size_t i = 1; i < 3; ++i) EXPECT_GE(found.self_similar[i - 1].overlap, found.self_similar[i].overlap);
}

TEST(FindSymmetries, MiddleHoleKeepsThePlate) {
  const auto found = find_symmetries(plate_with_hole(regular_polygon(4, 40), 10, {0, 0}, 9));
  EXPECT_EQ(found.group.discrete.size(), 8u);
}

TEST(FindSymmetries, GearHasAllItsTurns) {
  for (const int teeth : {8, 20, 48}) {
    SCOPED_TRACE(teeth);
    test::Outline outline;
    for (int i = 0; i < 4 * teeth; ++i) {
      const double radius = (i + 1) % 4 < 2 ? 30 : 30 - 60.0 / teeth;
      const double angle = 2 * kPi * (i + (i % 2 == 0 ? 0.2 : -0.2)) / (4 * teeth);
      outline.push_back(radius * Vec2(std::cos(angle), std::sin(angle)));
    }
    const auto found = find_symmetries(moved(plate_with_hole(outline, 10, {0, 0}, 6), random_pose(teeth)));
    EXPECT_TRUE(found.group.continuous.empty());
    EXPECT_EQ(found.group.discrete.size(), 2u * teeth);
  }
}

TEST(FindSymmetries, NothingIsLikeItselfInAnIrregularBody) {
  const Vec3 a(0, 0, 0), b(50, 3, 0), c(11, 33, 0), d(19, 7, 24);
  Mesh mesh;
  for (const auto& t : {std::array{a, c, b}, {a, b, d}, {b, c, d}, {c, a, d}})
    test::add_triangle(mesh, t[0], t[1], t[2]);
  const auto found = find_symmetries(mesh);
  EXPECT_EQ(found.group.discrete.size(), 1u);
  EXPECT_TRUE(found.group.continuous.empty());
}

TEST(FindSymmetries, SaysWhatIsWrong) {
  EXPECT_THROW(find_symmetries(Mesh{}), Error);
  SymmetryOptions options;
  options.min_overlap = 1.5;
  EXPECT_THROW(find_symmetries(box(1, 2, 3), options), Error);
}

}  // namespace
}  // namespace tribin
