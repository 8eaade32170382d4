#include "tribin/grasp/gripper_shape.hpp"

#include <gtest/gtest.h>

#include "grasp_scene.hpp"
#include "tribin/core/error.hpp"

namespace tribin::grasp {
namespace {

/// Extents along x of the jaws at an opening: of the one on the left, of the one on the right.
std::array<double, 4> jaws_along_x(const GripperShape& shape, double opening) {
  std::array<double, 4> out{1e9, -1e9, 1e9, -1e9};
  const auto pieces = pieces_at(shape, opening);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (!shape.pieces[i].jaw) continue;
    const double low = -reach_along(pieces[i], -Vec3::UnitX()), high = reach_along(pieces[i], Vec3::UnitX());
    const int k = low + high < 0 ? 0 : 2;
    out[k] = std::min(out[k], low);
    out[k + 1] = std::max(out[k + 1], high);
  }
  return out;
}

void expect_jaws(const GripperShape& shape, double opening, std::array<double, 4> wanted) {
  const auto seen = jaws_along_x(shape, opening);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(seen[k], wanted[k], 1e-9) << k;
}

TEST(GripperShape, FingersStandApartByTheOpening) {
  const GripperShape shape = gripper_shape(test::jaws());
  expect_jaws(shape, 30, {-25, -15, 15, 25});
  EXPECT_EQ(shape.pad.width_mm, 16);
  EXPECT_EQ(shape.pad.length_mm, 70);
  EXPECT_EQ(shape.pad.tip_mm, 5);
  EXPECT_TRUE(shape.warnings.empty());
}

TEST(GripperShape, InsideTheOpeningIsOverTheOuterFaces) {
  Gripper g = test::jaws();
  g.kind = GripperKind::parallel_inside;
  expect_jaws(gripper_shape(g), 30, {-15, -5, 5, 15});
}

TEST(GripperShape, ABlockAcrossTheMiddleIsTheClosedPair) {
  Gripper g = test::jaws(120);
  g.finger_mm.setZero();
  g.tip_mm = 0;
  g.flange_from_tcp.translation() = Vec3(0, 0, 180);
  g.boxes = {{Vec3(0, 0, 90), Vec3(80, 40, 180)}};
  const GripperShape shape = gripper_shape(g);
  expect_jaws(shape, 0, {-40, 0, 0, 40});
  expect_jaws(shape, 50, {-65, -25, 25, 65});
  // As long as half the largest part; the rest of the block stays where it is.
  EXPECT_EQ(shape.pad.length_mm, 60);
  ASSERT_EQ(shape.pieces.size(), 3u);
  EXPECT_FALSE(shape.pieces[2].jaw);
  EXPECT_NEAR(reach_along(shape.pieces[2].body, Vec3::UnitZ()), -60, 1e-9);
}

TEST(GripperShape, APairBesideTheMiddleHasTheOpeningItIsDrawnWith) {
  Gripper g = test::jaws();
  g.finger_mm.setZero();
  g.tip_mm = 0;
  g.boxes.push_back({Vec3(25, 0, 115), Vec3(10, 16, 60)});
  g.boxes.push_back({Vec3(-25, 0, 115), Vec3(10, 16, 60)});
  const GripperShape shape = gripper_shape(g);
  expect_jaws(shape, 40, {-30, -20, 20, 30});
  expect_jaws(shape, 10, {-15, -5, 5, 15});
  EXPECT_EQ(shape.pad.length_mm, 60);
}

TEST(GripperShape, JawsThatNobodyDrewAreSaid) {
  Gripper g = test::jaws();
  g.finger_mm.setZero();
  g.tip_mm = 0;
  const GripperShape shape = gripper_shape(g);
  ASSERT_EQ(shape.warnings.size(), 1u);
  EXPECT_NE(shape.warnings[0].find("draws no jaws"), std::string::npos);
  EXPECT_NEAR(shape.pad.length_mm, 65, 1e-9);  // from the body's front to the TCP
  EXPECT_NEAR(shape.pad.width_mm, 65.0 / 4, 1e-9);
}

TEST(GripperShape, ThreeJawsStandAround) {
  Gripper g = test::jaws();
  g.kind = GripperKind::three_jaw;
  const GripperShape shape = gripper_shape(g);
  ASSERT_EQ(shape.jaws, 3);
  for (const double opening : {20.0, 60.0}) {
    const auto pieces = pieces_at(shape, opening);
    int jaw = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (!shape.pieces[i].jaw) continue;
      const double angle = jaw++ * 2 * kPi / 3;
      EXPECT_NEAR(-reach_along(pieces[i], -Vec3(std::cos(angle), std::sin(angle), 0)), opening / 2, 1e-9);
    }
  }
}

TEST(GripperShape, ACupIsDrawnGivenOrRefused) {
  EXPECT_EQ(gripper_shape(test::cup(8)).cup_mm, 8);
  Gripper g = test::cup(0);
  try {
    gripper_shape(g);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_NE(std::string(e.what()).find("gripper cup"), std::string::npos);
  }
  g.cylinders = {{Vec3(0, 0, 90), Vec3::UnitZ(), 11, 60}};
  EXPECT_NEAR(gripper_shape(g).cup_mm, 11, 1e-9);
}

}  // namespace
}  // namespace tribin::grasp
