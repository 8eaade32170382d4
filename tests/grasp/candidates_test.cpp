#include "tribin/grasp/candidates.hpp"

#include <gtest/gtest.h>

#include <set>

#include "grasp_scene.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::grasp {
namespace {

using test::Known;

/// How many surface points of a part each jaw holds when it stands at an opening.
std::vector<int> points_in_jaws(const GripperShape& shape, const Candidate& c, double opening,
                                const std::vector<Vec3>& points) {
  std::vector<int> out;
  const auto pieces = pieces_at(shape, opening);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (!shape.pieces[i].jaw) continue;
    const Convex body = moved(c.part_from_tcp, pieces[i]);
    out.push_back(static_cast<int>(
        std::count_if(points.begin(), points.end(), [&](const Vec3& p) { return test::holds(body, p); })));
  }
  return out;
}

/// All of a gripper that lies in a part.
int points_in_gripper(const GripperShape& shape, const Candidate& c, double opening, const std::vector<Vec3>& points) {
  int count = 0;
  for (const Convex& piece : pieces_at(shape, opening)) {
    const Convex body = moved(c.part_from_tcp, piece);
    for (const Vec3& p : points) count += test::holds(body, p);
  }
  return count;
}

/// The laws of every candidate of jaws: nothing of the gripper is in the part as long as it is open; a little less
/// open than told, every jaw is; and the contacts look along the closing direction.
void expect_holds(const Known& known, double pitch) {
  const GripperShape& shape = known.grasps.grippers[0];
  const std::vector<Vec3> points = test::surface_points(known.part.mesh, pitch);
  ASSERT_FALSE(known.grasps.candidates.empty());
  const std::size_t step = std::max<std::size_t>(1, known.grasps.candidates.size() / 60);
  for (std::size_t i = 0; i < known.grasps.candidates.size(); i += step) {
    const Candidate& c = known.grasps.candidates[i];
    SCOPED_TRACE(c.family + " " + std::to_string(i));
    const double sign = shape.inside ? -1 : 1;
    EXPECT_EQ(points_in_gripper(shape, c, c.opening_mm + sign * 0.2, points), 0);
    for (const int held : points_in_jaws(shape, c, c.opening_mm - sign * 1.5, points)) EXPECT_GT(held, 0);
    EXPECT_LE(c.friction_angle, std::atan(shape.gripper.friction) + 1e-9);
    EXPECT_GE(c.opening_mm, shape.stroke_min());
    EXPECT_LE(c.opening_mm, shape.stroke_max());
  }
}

TEST(Candidates, JawsTouchBoxesOnOppositeFaces) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> side(12, 80);
  for (int seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const Vec3 size(side(random), side(random), side(random));
    const Known known(test::box_mesh(size));
    expect_holds(known, 1);
    for (const Candidate& c : known.grasps.candidates) {
      int axis = 0;
      EXPECT_GT(c.part_from_tcp.linear().col(0).cwiseAbs().maxCoeff(&axis), 0.95);
      // Held across two faces, or by their edges where the jaws are turned a little in their plane.
      EXPECT_NEAR(c.opening_mm, size[axis], 1);
    }
  }
}

TEST(Candidates, JawsHoldCylindersAcrossAndFromTheirEnds) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> radius(8, 40), height(20, 90);
  for (int seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE(seed);
    const double r = radius(random), h = height(random);
    const Known known(test::cylinder_mesh(r, h));
    expect_holds(known, 1);
    int radial = 0, ends = 0;
    for (const Candidate& c : known.grasps.candidates) {
      if (c.family.find("radial") != std::string::npos) {
        ++radial;
        EXPECT_NEAR(c.opening_mm, 2 * r, 0.1 + 0.02 * r);
        EXPECT_NEAR(std::abs(c.part_from_tcp.linear()(2, 1)), 1, 1e-3);  // the pads lie along the axis
      }
      ends += c.family.find("end") != std::string::npos;
    }
    EXPECT_GT(radial, 20);
    EXPECT_GT(ends, 10);
  }
}

TEST(Candidates, BoresAreHeldFromInside) {
  Gripper g = test::jaws();
  g.kind = GripperKind::parallel_inside;
  g.stroke_mm = {22, 90};
  g.boxes = {{Vec3(0, 0, 30), Vec3(60, 60, 60)}};
  for (const double inner : {16.0, 22.0, 35.0}) {
    SCOPED_TRACE(inner);
    const Known known(test::ring_mesh(inner + 15, inner, 30), g);
    expect_holds(known, 1);
    for (const Candidate& c : known.grasps.candidates) {
      // Flat pads of 16 mm touch the round with their edges.
      EXPECT_NEAR(c.opening_mm, 2 * std::sqrt(inner * inner - 64), 1.5);
      EXPECT_GT(std::abs(c.part_from_tcp.linear()(2, 2)), 0.99);
    }
  }
}

TEST(Candidates, ThreeJawsHoldRoundsByTheirEnds) {
  Gripper g = test::jaws();
  g.kind = GripperKind::three_jaw;
  const Known known(test::cylinder_mesh(20, 50), g);
  expect_holds(known, 1);
  for (const Candidate& c : known.grasps.candidates) {
    EXPECT_NEAR(c.opening_mm, 40, 1);
    EXPECT_LT(c.part_from_tcp.translation().head<2>().norm(), 0.5);
  }
  // There is no third side on a box's pair of faces.
  EXPECT_TRUE(Known(test::box_mesh(Vec3(20, 30, 40)), g).grasps.candidates.empty());
}

TEST(Candidates, CupsStandInsideOfFlatFaces) {
  const double r = 8;
  const Vec3 size(60, 40, 25);
  const Known known(test::box_mesh(size), test::cup(r));
  ASSERT_FALSE(known.grasps.candidates.empty());
  std::set<std::string> faces;
  for (const Candidate& c : known.grasps.candidates) {
    faces.insert(c.family);
    const Vec3 at = c.part_from_tcp.translation(), in = c.part_from_tcp.linear().col(2);
    int axis = 0;
    EXPECT_GT(in.cwiseAbs().maxCoeff(&axis), 0.999);
    EXPECT_NEAR(at[axis], in[axis] > 0 ? 0 : size[axis], 1e-6);
    for (int k = 0; k < 3; ++k)
      if (k != axis) {
        EXPECT_GE(at[k], r);
        EXPECT_LE(at[k], size[k] - r);
      }
  }
  EXPECT_EQ(faces.size(), 6u);
  // No cup on a rod that falls off under its lip, nor over a hole.
  EXPECT_TRUE(Known(test::cylinder_mesh(9, 60), test::cup(r)).grasps.candidates.empty());
  EXPECT_TRUE(Known(test::ring_mesh(20, 8, 10), test::cup(r)).grasps.candidates.empty());
}

TEST(Candidates, TaughtPointsTakeTheSymmetryAndTheirLeave) {
  CellPart cell;
  PickPoint point;
  point.name = "side";
  point.part_from_tcp = test::at(0, 0, 30, Vec3(0, -kPi / 2, 0));  // from -x... along -x of the part
  point.priority = 2;
  cell.pick_points = {point};
  const Known round(test::cylinder_mesh(20, 60), test::jaws(), cell);
  ASSERT_EQ(round.part.symmetry.continuous.size(), 1u);
  // A round part is held from all around, and from its other end as from this one.
  EXPECT_GE(round.grasps.candidates.size(), 24u);
  double least = 1, most = -1;
  for (const Candidate& c : round.grasps.candidates) {
    EXPECT_EQ(c.family, "taught side");
    EXPECT_EQ(c.priority, 2);
    EXPECT_NEAR(c.part_from_tcp.translation().z(), 30, 1e-6);
    least = std::min(least, c.part_from_tcp.linear()(0, 2));
    most = std::max(most, c.part_from_tcp.linear()(0, 2));
  }
  EXPECT_LT(least, -0.99);
  EXPECT_GT(most, 0.99);

  point.part_from_tcp = test::at(15, 10, 20, Vec3(kPi, 0, 0));  // from above
  cell.pick_points = {point};
  const Mesh box = test::box_mesh(Vec3(30, 20, 45));
  const std::size_t exact = Known(box, test::jaws(), cell).grasps.candidates.size();
  cell.pick_points[0].tilt_rad = 20 * kDegree;
  const std::size_t tilted = Known(box, test::jaws(), cell).grasps.candidates.size();
  cell.pick_points[0].tilt_rad = 0;
  cell.pick_points[0].roll_rad = kPi;
  const std::size_t rolled = Known(box, test::jaws(), cell).grasps.candidates.size();
  EXPECT_GT(tilted, exact);
  EXPECT_GT(rolled, exact);
}

TEST(Candidates, AreTheSameForAnyNumberOfThreads) {
  const Mesh mesh = test::cylinder_mesh(18, 55);
  set_thread_count(1);
  const Known one(mesh);
  set_thread_count(0);
  const Known many(mesh);
  ASSERT_EQ(one.grasps.candidates.size(), many.grasps.candidates.size());
  for (std::size_t i = 0; i < one.grasps.candidates.size(); ++i) {
    EXPECT_EQ(one.grasps.candidates[i].family, many.grasps.candidates[i].family);
    EXPECT_EQ(one.grasps.candidates[i].part_from_tcp.matrix(), many.grasps.candidates[i].part_from_tcp.matrix());
  }
}

TEST(Candidates, AGripperThatFitsNowhereIsNamed) {
  const Known known(test::box_mesh(Vec3(120, 130, 140)), test::jaws(100));
  EXPECT_TRUE(known.grasps.candidates.empty());
  ASSERT_EQ(known.grasps.warnings.size(), 1u);
  EXPECT_NE(known.grasps.warnings[0].find("gripper jaws finds no hold"), std::string::npos);
}

}  // namespace
}  // namespace tribin::grasp
