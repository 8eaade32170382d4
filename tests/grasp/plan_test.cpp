#include <gtest/gtest.h>

#include <set>

#include "grasp_scene.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::grasp {
namespace {

using test::at;
using test::here;
using test::in_bin;
using test::Known;
using test::on_floor;
using test::rod;

const Known& block() {
  static const Known known(test::box_mesh(Vec3(50, 30, 40)));
  return known;
}

Mesh bin_walls(const CellBin& bin) {
  Mesh mesh;
  const Vec3f s = bin.inner_size_mm.cast<float>() / 2;
  const float w = static_cast<float>(bin.wall_mm), h = 2 * s.z();
  tribin::test::add_box(mesh, Vec3f(-s.x() - w, -s.y() - w, 0), Vec3f(-s.x(), s.y() + w, h));
  tribin::test::add_box(mesh, Vec3f(s.x(), -s.y() - w, 0), Vec3f(s.x() + w, s.y() + w, h));
  tribin::test::add_box(mesh, Vec3f(-s.x(), -s.y() - w, 0), Vec3f(s.x(), -s.y(), h));
  tribin::test::add_box(mesh, Vec3f(-s.x(), s.y(), 0), Vec3f(s.x(), s.y() + w, h));
  return mesh;
}

/// Parts of both kinds, lying anywhere but not in each other.
Scene heap(unsigned seed, int count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  Scene scene = in_bin();
  for (int tries = 0; tries < 200 && static_cast<int>(scene.parts.size()) < count; ++tries) {
    const bool lies = number(random) < 0;
    const Known& known = number(random) < 0 ? rod() : block();
    const Matrix3 turn = rotation_from_vector(Vec3(0, 0, kPi * number(random)));
    const Pose pose = on_floor(known.part, 110 * number(random), 80 * number(random),
                               vector_from_rotation(turn * rotation_from_vector(Vec3(lies ? kPi / 2 : 0, 0, 0))));
    bool free = true;
    for (const PartHere& other : scene.parts) {
      const Vec3 apart = other.base_from_part * other.part->part->box_center() - pose * known.part.box_center();
      free = free && apart.norm() > 0.5 * (other.part->part->diameter_mm + known.part.diameter_mm);
    }
    if (free) scene.parts.push_back(here(known, pose));
  }
  return scene;
}

const WhyCount* count_of(const std::vector<WhyCount>& reasons, Why why) {
  for (const WhyCount& count : reasons)
    if (count.why == why) return &count;
  return nullptr;
}

/// All grasps of a plan were refused, and this is among the reasons.
void expect_refused(const Plan& plan, Why why) {
  EXPECT_TRUE(plan.grasps.empty()) << plan.grasps.size() << " grasps, wanted " << name_of(why);
  EXPECT_TRUE(count_of(plan.reasons, why)) << name_of(why);
}

ArmHere arm_for(const robot::RobotModel& robot) { return {&robot, &robot.arms[0], 0, {}}; }

/// A GP110 that stands 1.2 m from the bin.
robot::RobotModel gp110_beside() {
  robot::RobotModel robot;
  robot.name = "GP110";
  robot.arms = {tribin::test::gp110()};
  robot.arms[0].mount_from_arm = at(-1200, 0, 0);
  return robot;
}

// --- laws ---------------------------------------------------------------------------------------------------------

TEST(PlanGrasps, NothingThatMovesTouchesAnything) {
  int grasps = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Scene scene = heap(seed, 7);
    const Mesh walls = bin_walls(*scene.bin);
    const Scan scan = test::seen(scene, {{&walls, Pose::Identity()}}, seed);
    scene.scan = &scan;
    const Plan plan = plan_grasps(scene);
    std::vector<Vec3> points = test::surface_points(walls, 12);
    for (const PartHere& part : scene.parts)
      for (const Vec3& p : test::surface_points(part.part->part->mesh, 6)) points.push_back(part.base_from_part * p);
    for (std::size_t n = 0; n < plan.grasps.size(); n += 2) {
      const Grasp& g = plan.grasps[n];
      SCOPED_TRACE(g.family);
      ++grasps;
      const GripperShape& shape = scene.parts[g.part].part->grippers[0];
      const Pose part_from_tcp = g.part_from_tcp;
      EXPECT_TRUE((scene.parts[g.part].base_from_part * part_from_tcp).isApprox(g.at(Step::pick)->base_from_tcp, 1e-9));
      for (std::size_t i = 0; i + 1 < g.path.size(); ++i)
        for (int k = 0; k <= 4; ++k) {
          Pose pose = g.path[i].base_from_tcp;
          pose.translation() += k / 4.0 * (g.path[i + 1].base_from_tcp.translation() - pose.translation());
          for (const Convex& piece : pieces_at(shape, g.opening_before_mm)) {
            const Convex body = moved(pose, piece);
            EXPECT_EQ(std::count_if(points.begin(), points.end(), [&](const Vec3& p) { return test::holds(body, p); }),
                      0);
            EXPECT_GT(-reach_along(body, -Vec3::UnitZ()), 0) << "floor";
          }
        }
      // It begins and ends above the bin.
      for (const PathPoint* end : {&g.path.front(), &g.path.back()})
        for (const Convex& piece : pieces_at(shape, g.opening_before_mm))
          EXPECT_GT(-reach_along(moved(end->base_from_tcp, piece), -Vec3::UnitZ()), 100);
    }
  }
  EXPECT_GT(grasps, 20);
}

TEST(PlanGrasps, ScoresAreProductsOfTheirTermsBestFirst) {
  Scene scene = heap(3, 7);
  const Plan plan = plan_grasps(scene);
  ASSERT_GT(plan.grasps.size(), 5u);
  double last = 1;
  for (const Grasp& g : plan.grasps) {
    double product = 1;
    std::set<std::string> names;
    for (const Term& term : g.terms) {
      EXPECT_GE(term.value, 0);
      EXPECT_LE(term.value, 1);
      EXPECT_TRUE(names.insert(term.name).second) << term.name;
      product *= term.value;
    }
    EXPECT_NEAR(g.score, product, 1e-12);
    EXPECT_GT(g.score, 0);
    EXPECT_LE(g.score, last);
    last = g.score;
    EXPECT_GT(g.opening_before_mm, g.opening_mm);
  }
  int counted = 0;
  for (const WhyCount& count : plan.reasons) counted += count.count;
  EXPECT_EQ(counted, static_cast<int>(plan.refused.size()));
}

TEST(PlanGrasps, MovingAllOfTheCellChangesNothing) {
  Scene scene = heap(5, 6);
  const Scan scan = test::seen(scene);
  scene.scan = &scan;
  const Plan plan = plan_grasps(scene);
  ASSERT_FALSE(plan.grasps.empty());
  const Pose move = at(400, -250, 120, Vec3(0, 0, 0.7));
  Scene there = scene;
  there.base_from_camera = move * scene.base_from_camera;
  there.bin->base_from_bin = move * scene.bin->base_from_bin;
  for (PartHere& part : there.parts) part.base_from_part = move * part.base_from_part;
  const Plan moved_plan = plan_grasps(there);
  // Cells of columns lie elsewhere on the parts: shares that are read from them change by a hundredth or two, and so
  // may the order of near equals. Each part is held as well as before.
  std::map<int, double> best, best_there;
  for (const Grasp& g : plan.grasps) best[g.part] = std::max(best[g.part], g.score);
  for (const Grasp& g : moved_plan.grasps) best_there[g.part] = std::max(best_there[g.part], g.score);
  ASSERT_EQ(best.size(), best_there.size());
  for (const auto& [part, score] : best) EXPECT_NEAR(best_there[part], score, 0.03) << part;
}

TEST(PlanGrasps, AreTheSameForAnyNumberOfThreads) {
  Scene scene = heap(6, 7);
  const Scan scan = test::seen(scene);
  scene.scan = &scan;
  set_thread_count(1);
  const Plan one = plan_grasps(scene);
  set_thread_count(0);
  const Plan many = plan_grasps(scene);
  ASSERT_EQ(one.grasps.size(), many.grasps.size());
  for (std::size_t i = 0; i < one.grasps.size(); ++i) {
    EXPECT_EQ(one.grasps[i].score, many.grasps[i].score);
    EXPECT_EQ(one.grasps[i].part_from_tcp.matrix(), many.grasps[i].part_from_tcp.matrix());
  }
  EXPECT_EQ(one.refused.size(), many.refused.size());
}

TEST(PlanGrasps, RoundPartsAreHeldFromTheSideThatIsUp) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    // Rolled about its own axis by any angle, then laid down: it is the same part.
    Scene scene = in_bin();
    const Pose lying = on_floor(rod().part, 0, 0, Vec3(0, kPi / 2, 0));
    PartHere part = here(rod(), lying * at(0, 0, 0, Vec3(0, 0, angle(random))));
    scene.parts = {part};
    const Plan plan = plan_grasps(scene);
    ASSERT_FALSE(plan.grasps.empty());
    EXPECT_GT(-plan.grasps[0].at(Step::pick)->base_from_tcp.linear()(2, 2), std::cos(16 * kDegree));
  }
}

TEST(PlanGrasps, ArmsGoStraightInOneConfiguration) {
  const robot::RobotModel robot = gp110_beside();
  Scene scene = heap(8, 6);
  scene.arm = arm_for(robot);
  const Plan plan = plan_grasps(scene);
  ASSERT_FALSE(plan.grasps.empty());
  for (const Grasp& g : plan.grasps) {
    const int form = form_bits(robot.arms[0], g.path[0].joints) & 7;
    for (const PathPoint& point : g.path) {
      const Pose flange = base_from_arm(robot, robot.arms[0]) * arm_from_flange(robot.arms[0], point.joints);
      const Pose tcp = flange * scene.parts[g.part].part->grippers[0].gripper.flange_from_tcp;
      EXPECT_LT((tcp.translation() - point.base_from_tcp.translation()).norm(), 1e-6);
      EXPECT_LT(rotation_angle(tcp.linear(), point.base_from_tcp.linear()), 1e-8);
      EXPECT_EQ(form_bits(robot.arms[0], point.joints) & 7, form);
      EXPECT_GE(margins(robot.arms[0], point.joints).limit, PlanOptions{}.limit_margin_rad - 1e-6);
    }
  }
}

// --- each reason ----------------------------------------------------------------------------------------------------

Scene one_rod() {
  Scene scene = in_bin();
  scene.parts = {here(rod(), on_floor(rod().part, 0, 0, Vec3(0, kPi / 2, 0)))};
  return scene;
}

TEST(PlanGraspsRefuses, Confidence) {
  Scene scene = one_rod();
  scene.parts[0].score = 0.4;
  PlanOptions options;
  options.min_score = 0.5;
  expect_refused(plan_grasps(scene, options), Why::confidence);
}

TEST(PlanGraspsRefuses, CoveredByAnotherPart) {
  Scene scene = one_rod();
  Pose above = on_floor(block().part, 0, 0);
  above.translation().z() += 29;
  scene.parts.push_back(here(block(), above));
  const Plan plan = plan_grasps(scene);
  ASSERT_TRUE(count_of(plan.reasons, Why::covered));
  for (const Grasp& g : plan.grasps) EXPECT_EQ(g.part, 1);
  EXPECT_FALSE(plan.grasps.empty());
}

TEST(PlanGraspsRefuses, CoveredByWhatNobodyKnows) {
  Scene scene = one_rod();
  const Mesh lid = test::box_mesh(Vec3(60, 60, 5));
  const Scan scan = test::seen(scene, {{&lid, at(-30, -30, 34)}});
  scene.scan = &scan;
  expect_refused(plan_grasps(scene), Why::covered);
}

TEST(PlanGraspsRefuses, Hold) {
  CellPart heavy;
  heavy.mass_kg = 20;  // 60 N of friction, 196 N of weight
  const Known known(test::cylinder_mesh(14, 60), test::jaws(), heavy);
  Scene scene = in_bin();
  scene.parts = {here(known, on_floor(known.part, 0, 0))};
  const Plan plan = plan_grasps(scene);
  expect_refused(plan, Why::hold);
  EXPECT_NEAR(plan.refused[0].value, 2 * 0.3 * 100 / (20 * 9.81), 1e-9);
}

TEST(PlanGraspsRefuses, TriedBefore) {
  const Scene scene = one_rod();
  const Plan plan = plan_grasps(scene);
  ASSERT_FALSE(plan.grasps.empty());
  PlanOptions options;
  options.failed = {{plan.grasps[0].at(Step::pick)->base_from_tcp, "jaws"}};
  const Plan again = plan_grasps(scene, options);
  EXPECT_TRUE(count_of(again.reasons, Why::tried_before));
  for (const Grasp& g : again.grasps) {
    const Pose &a = g.at(Step::pick)->base_from_tcp, &b = options.failed[0].base_from_tcp;
    EXPECT_TRUE((a.translation() - b.translation()).norm() > 4 || rotation_angle(a.linear(), b.linear()) > 0.17);
    EXPECT_LT(g.score, plan.grasps[0].score);
  }
}

TEST(PlanGraspsRefuses, ApproachAngle) {
  CellPart cell;
  cell.max_tilt_rad = 40 * kDegree;
  PickPoint point;  // along the rod's axis only
  point.part_from_tcp = at(0, 0, 55, Vec3(kPi, 0, 0));
  cell.pick_points = {point};
  const Known known(test::cylinder_mesh(14, 60), test::jaws(), cell);
  ASSERT_FALSE(known.grasps.candidates.empty());
  Scene scene = in_bin();
  scene.parts = {here(known, on_floor(known.part, 0, 0, Vec3(0, kPi / 2, 0)))};
  expect_refused(plan_grasps(scene), Why::approach_angle);
  scene.parts[0].base_from_part = on_floor(known.part, 0, 0);
  EXPECT_FALSE(plan_grasps(scene).grasps.empty());
}

TEST(PlanGraspsRefuses, Stroke) {
  const Known known(test::cylinder_mesh(14, 60));
  GraspPart narrow = known.grasps;  // another stroke than the candidates were found with
  narrow.grippers[0].gripper.stroke_mm = {0, 20};
  Scene scene = in_bin();
  scene.parts = {here(known, on_floor(known.part, 0, 0))};
  scene.parts[0].part = &narrow;
  expect_refused(plan_grasps(scene), Why::stroke);
}

TEST(PlanGraspsRefuses, PoseSigma) {
  const Known wide(test::box_mesh(Vec3(96, 96, 96)));  // 2 mm a side are left
  Scene scene = in_bin();
  scene.parts = {here(wide, on_floor(wide.part, 0, 0), 0.1)};
  EXPECT_FALSE(plan_grasps(scene).grasps.empty());
  scene.parts[0].covariance *= 100;  // 3 sigma = 3 mm
  const Plan plan = plan_grasps(scene);
  expect_refused(plan, Why::pose_sigma);
  scene.parts[0].covariance /= 100;
  scene.hand_eye_sigma_mm = 1;
  expect_refused(plan_grasps(scene), Why::pose_sigma);
}

TEST(PlanGraspsRefuses, Workspace) {
  Scene scene = one_rod();
  scene.workspace = CellRange{Vec3(-500, -500, 0), Vec3(500, 500, 60)};  // pre-pick lies higher
  expect_refused(plan_grasps(scene), Why::workspace);
}

TEST(PlanGraspsRefuses, Reach) {
  robot::RobotModel robot = gp110_beside();
  robot.arms[0].mount_from_arm = at(-4000, 0, 0);
  Scene scene = one_rod();
  scene.arm = arm_for(robot);
  expect_refused(plan_grasps(scene), Why::reach);
}

TEST(PlanGraspsRefuses, Form) {
  // Each place alone is in reach, but the wrist changes its form on the way.
  robot::RobotModel robot = gp110_beside();
  const robot::Arm& arm = robot.arms[0];
  Scene scene = one_rod();
  scene.arm = arm_for(robot);
  PlanOptions options;
  options.retreat_mm = 900;
  int forms = 0;
  for (double x = -2000; x <= -600; x += 100) {
    robot.arms[0].mount_from_arm = at(x, 0, 0);
    const Plan plan = plan_grasps(scene, options);
    for (const RefusedGrasp& r : plan.refused) {
      if (r.why != Why::form) continue;
      ++forms;
      const Pose flange = r.base_from_tcp * scene.parts[0].part->grippers[0].gripper.flange_from_tcp.inverse();
      EXPECT_TRUE(reach(arm, base_from_arm(robot, arm).inverse() * flange));
    }
  }
  EXPECT_GT(forms, 0);
}

TEST(PlanGraspsRefuses, Bin) {
  Scene scene = in_bin();
  scene.bin->inner_size_mm = Vec3(80, 40, 160);  // as narrow as the part: no room for fingers, nor for the hand
  scene.parts = {here(rod(), on_floor(rod().part, 0, 0, Vec3(0, kPi / 2, 0)))};
  expect_refused(plan_grasps(scene), Why::bin);
}

TEST(PlanGraspsRefuses, Scan) {
  Scene scene = one_rod();
  // Unknown blocks all around it, as high as the part.
  const Mesh beside = test::box_mesh(Vec3(120, 30, 60)), across = test::box_mesh(Vec3(30, 40, 60));
  const Scan scan = test::seen(
      scene,
      {{&beside, at(-60, 17, 0)}, {&beside, at(-60, -47, 0)}, {&across, at(33, -20, 0)}, {&across, at(-63, -20, 0)}});
  scene.scan = &scan;
  expect_refused(plan_grasps(scene), Why::scan);
}

TEST(PlanGraspsRefuses, Part) {
  // The same with found parts, and no scan.
  const Known beside(test::box_mesh(Vec3(120, 30, 60))), across(test::box_mesh(Vec3(30, 40, 60)));
  Scene scene = one_rod();
  for (const auto& [known, pose] : std::vector<std::pair<const Known*, Pose>>{{&beside, at(-60, 17, 0)},
                                                                              {&beside, at(-60, -47, 0)},
                                                                              {&across, at(33, -20, 0)},
                                                                              {&across, at(-63, -20, 0)}}) {
    scene.parts.push_back(here(*known, pose));
    scene.parts.back().pick = false;
  }
  expect_refused(plan_grasps(scene), Why::part);
}

TEST(PlanGraspsRefuses, Obstacle) {
  Scene scene = one_rod();
  scene.obstacles = {make_box(at(0, 0, 120), Vec3(400, 400, 20))};  // a shelf above
  expect_refused(plan_grasps(scene), Why::obstacle);
}

TEST(PlanGraspsRefuses, HeldBin) {
  // The bin leans: straight up leads into its wall.
  Scene scene = in_bin();
  scene.bin->base_from_bin.linear() = rotation_from_vector(Vec3(0, 25 * kDegree, 0));
  const Pose flat = on_floor(block().part, -122, 0);
  scene.parts = {here(block(), scene.bin->base_from_bin * flat)};
  const Plan plan = plan_grasps(scene);
  scene.parts[0].base_from_part = scene.bin->base_from_bin * on_floor(block().part, 122, 0);
  const Plan other = plan_grasps(scene);
  EXPECT_TRUE(count_of(plan.reasons, Why::held_bin) || count_of(other.reasons, Why::held_bin));
}

TEST(PlanGraspsRefuses, HeldPart) {
  // A thin plate stands close beside the rod, between the jaws.
  const Known plate(test::box_mesh(Vec3(50, 3, 20)));
  Scene scene = one_rod();
  scene.parts.push_back(here(plate, at(-25, 14.5, 0)));
  scene.parts.back().pick = false;
  scene.parts[0].covariance *= 27 * 27;  // 3 sigma = 8 mm: jaws open wide
  const Plan plan = plan_grasps(scene);
  EXPECT_TRUE(count_of(plan.reasons, Why::held_part));
}

TEST(PlanGraspsRefuses, ArmBin) {
  robot::RobotModel robot = gp110_beside();
  robot.arms[0].capsules = {
      {6, Vec3(0, 0, -20), Vec3(0, 0, -20), 180}};  // a plate behind the flange as wide as the bin
  Scene scene = one_rod();
  scene.bin->inner_size_mm = Vec3(300, 240, 200);
  scene.arm = arm_for(robot);
  PlanOptions options;
  expect_refused(plan_grasps(scene, options), Why::arm_bin);
}

TEST(PlanGraspsRefuses, ArmScan) {
  robot::RobotModel robot = gp110_beside();
  robot.arms[0].capsules = {{6, Vec3(0, 120, -20), Vec3(0, 120, -20), 40}};  // a camera beside the hand
  robot.arms[0].capsules.push_back({6, Vec3(0, -120, -20), Vec3(0, -120, -20), 40});
  robot.arms[0].capsules.push_back({6, Vec3(120, 0, -20), Vec3(120, 0, -20), 40});
  robot.arms[0].capsules.push_back({6, Vec3(-120, 0, -20), Vec3(-120, 0, -20), 40});
  Scene scene = one_rod();
  scene.bin.reset();
  const Mesh tower = test::box_mesh(Vec3(60, 400, 170));
  const Scan scan = test::seen(scene, {{&tower, at(75, -200, 0)}, {&tower, at(-135, -200, 0)}});
  scene.scan = &scan;
  scene.arm = arm_for(robot);
  expect_refused(plan_grasps(scene), Why::arm_scan);
}

TEST(PlanGraspsRefuses, WhatTheFlangeCarries) {
  robot::RobotModel robot = gp110_beside();
  robot.arms[0].capsules = {{1, Vec3::Zero(), Vec3::Zero(), 10}};
  Scene scene = one_rod();
  scene.arm = arm_for(robot);
  EXPECT_FALSE(plan_grasps(scene).grasps.empty());
  scene.on_flange = {make_capsule(Vec3(0, 0, 20), Vec3(0, 0, 20), 190)};  // a camera as wide as the bin
  expect_refused(plan_grasps(scene), Why::arm_bin);
}

TEST(PlanGraspsRefuses, ArmObstacle) {
  robot::RobotModel robot = gp110_beside();
  Scene scene = one_rod();
  scene.arm = arm_for(robot);
  EXPECT_FALSE(plan_grasps(scene).grasps.empty());
  scene.obstacles = {make_box(at(-600, 0, 700), Vec3(200, 2000, 600))};  // a beam through the forearm
  const Plan plan = plan_grasps(scene);
  expect_refused(plan, Why::arm_obstacle);
}

TEST(PlanGraspsRefuses, Place) {
  const robot::RobotModel robot = gp110_beside();
  Scene scene = one_rod();
  scene.arm = arm_for(robot);
  scene.parts[0].base_from_placed = {at(0, 5000, 0)};
  expect_refused(plan_grasps(scene), Why::place);
  scene.parts[0].base_from_placed.push_back(scene.parts[0].base_from_part);
  EXPECT_FALSE(plan_grasps(scene).grasps.empty());
}

TEST(PlanGrasps, EveryReasonHasAName) {
  std::set<std::string_view> names;
  for (int i = 0; i < kWhys; ++i) names.insert(name_of(static_cast<Why>(i)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(kWhys));
}

TEST(PlanGrasps, OptionsOutOfRangeAreNamed) {
  PlanOptions options;
  options.approach_mm = -1;
  EXPECT_THROW(plan_grasps(Scene{}, options), std::exception);
}

}  // namespace
}  // namespace tribin::grasp
