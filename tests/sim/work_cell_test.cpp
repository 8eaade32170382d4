#include "tribin/sim/work_cell.hpp"

#include <gtest/gtest.h>

#include <set>

#include "sim/cell_errors.hpp"
#include "sim/grip.hpp"
#include "sim/live_heap.hpp"
#include "sim/random.hpp"
#include "support/solids.hpp"
#include "tribin/config/robot_file.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/part/part.hpp"
#include "tribin/picking/rack.hpp"
#include "tribin/picking/vision.hpp"
#include "tribin/robot/handshake.hpp"

namespace tribin::sim {
namespace {

const std::filesystem::path kSource = TRIBIN_SOURCE_DIR;

Gripper jaws() {
  Gripper gripper;
  gripper.name = "jaw";
  gripper.stroke_mm = {0, 100};
  gripper.force_n = 100;
  gripper.finger_mm = Vec3(8, 20, 60);
  gripper.tip_mm = 5;
  gripper.flange_from_tcp.translation() = Vec3(0, 0, 150);
  return gripper;
}

Mesh block(const Vec3& size) {
  Mesh mesh = bin_mesh({size.x(), size.y(), size.z(), 1});  // for its vertices' order only
  mesh.vertices.clear();
  mesh.triangles.clear();
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(Vec3f(static_cast<float>((i & 1 ? 0.5 : -0.5) * size.x()),
                                  static_cast<float>((i & 2 ? 0.5 : -0.5) * size.y()),
                                  static_cast<float>((i & 4 ? 0.5 : -0.5) * size.z())));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(Grip, JawsCentreABlockAndHoldIt) {
  const Mesh mesh = block(Vec3(40, 60, 30));
  const Solid solid(mesh);
  Pose tcp_from_part = Pose::Identity();
  tcp_from_part.translation() = Vec3(3, 2, 0);
  const Grip grip = close_gripper(grasp::gripper_shape(jaws()), 60, solid, tcp_from_part, 0.3, 1);
  ASSERT_TRUE(grip.holds) << grip.why;
  EXPECT_NEAR(grip.motion.translation().x(), -3, 0.1);
  EXPECT_NEAR(grip.opening_mm, 40, 0.1);
}

TEST(Grip, NothingIsHeldThatPhysicsWouldLetGo) {
  const Mesh mesh = block(Vec3(40, 60, 30));
  const Solid solid(mesh);
  const grasp::GripperShape shape = grasp::gripper_shape(jaws());
  Pose here = Pose::Identity();
  EXPECT_FALSE(close_gripper(shape, 39, solid, here, 0.3, 1).holds);   // wider than the jaws stand open
  EXPECT_FALSE(close_gripper(shape, 60, solid, here, 0.3, 50).holds);  // too heavy
  Pose beside = here;
  beside.translation() = Vec3(0, 80, 0);
  EXPECT_FALSE(close_gripper(shape, 60, solid, beside, 0.3, 1).touches);
}

TEST(Grip, JawsAlignWhatFrictionDoesNotHold) {
  const Mesh mesh = block(Vec3(40, 60, 30));
  const Solid solid(mesh);
  for (const double degrees : {-12.0, -5.0, 3.0, 10.0}) {
    Pose turned = Pose::Identity();
    turned.linear() = rotation_from_vector(Vec3(0, 0, degrees * kDegree));
    const Grip grip = close_gripper(grasp::gripper_shape(jaws()), 90, solid, turned, 0.3, 1);
    ASSERT_TRUE(grip.holds) << degrees << grip.why;
    // Contacts at opposite rims of pads 20 mm wide lie 27 deg aslant: it turns until they are within friction.
    const double left = rotation_angle((grip.motion * turned).linear(), Matrix3::Identity());
    EXPECT_LE(left, std::abs(degrees) * kDegree + 1e-9);
    EXPECT_LT(left, 4.1 * kDegree) << degrees;
  }
}

TEST(Grip, AWedgeSlipsOut) {
  for (const double slope : {10.0, 30.0}) {  // of both sides; friction 0.3 holds up to 17 deg
    Mesh mesh = block(Vec3(40, 60, 60));
    for (Vec3f& v : mesh.vertices) v.x() *= 1 + v.z() / 20 * static_cast<float>(std::tan(slope * kDegree));
    const Solid solid(mesh);
    EXPECT_EQ(close_gripper(grasp::gripper_shape(jaws()), 95, solid, Pose::Identity(), 0.3, 1).holds, slope < 17);
  }
}

TEST(Grip, ACupWantsAFlatPlaceUnderItsWholeRim) {
  const Mesh mesh = block(Vec3(60, 60, 20));
  const Solid solid(mesh);
  Gripper cup;
  cup.name = "cup";
  cup.kind = GripperKind::suction;
  cup.cup_radius_mm = 10;
  cup.force_n = 50;
  cup.flange_from_tcp.translation() = Vec3(0, 0, 100);
  const grasp::GripperShape shape = grasp::gripper_shape(cup);
  Pose below = Pose::Identity();
  below.translation() = Vec3(0, 0, 11);  // its top 1 mm beyond the cup's plane
  EXPECT_TRUE(close_gripper(shape, 0, solid, below, 0.3, 1).holds);
  Pose at_edge = below;
  at_edge.translation().x() = 25;
  EXPECT_FALSE(close_gripper(shape, 0, solid, at_edge, 0.3, 1).holds);
  Pose tilted = below;
  tilted.linear() = rotation_from_vector(Vec3(10 * kDegree, 0, 0));
  EXPECT_FALSE(close_gripper(shape, 0, solid, tilted, 0.3, 1).holds);
  EXPECT_FALSE(close_gripper(shape, 0, solid, below, 0.3, 10).holds);
}

TEST(LiveHeap, WhatLeansOnATakenPartFalls) {
  const Mesh mesh = block(Vec3(60, 60, 40));
  const Solid solid(mesh);
  Pose low = Pose::Identity(), high = low;
  low.translation() = Vec3(0, 0, 20.3);
  high.translation() = Vec3(5, 0, 60.6);
  LiveHeap heap({300, 300, 200, 5}, {&solid, &solid}, {low, high});
  EXPECT_TRUE(heap.at_rest());
  for (int i = 0; i < 100; ++i) heap.step();
  EXPECT_TRUE(heap.at_rest());  // nothing moves by itself
  heap.hold(0);
  for (int i = 0; i < 200; ++i) {
    Pose away = low;
    away.translation() += Vec3(0, 0.6 * i, 0);
    heap.move(0, away);
    heap.step();
  }
  for (int i = 0; i < 1200 && !heap.at_rest(); ++i) heap.step();
  EXPECT_TRUE(heap.at_rest());
  EXPECT_LT(heap.pose(1).translation().z(), 45);
}

TEST(LiveHeap, WallsEndAtTheRim) {
  const Mesh mesh = block(Vec3(20, 20, 20));
  const Solid solid(mesh);
  LiveHeap heap({300, 200, 100, 8}, {}, {});
  const int tool = heap.add_tool(solid);
  const auto depth_at = [&](const Vec3& at) {
    Pose pose = Pose::Identity();
    pose.translation() = at;
    heap.move(tool, pose);
    return heap.depth_in_walls_mm(tool);
  };
  EXPECT_EQ(depth_at(Vec3(0, 0, 11)), 0);
  EXPECT_NEAR(depth_at(Vec3(0, 0, 8)), 2, 0.1);
  EXPECT_NEAR(depth_at(Vec3(143, 0, 50)), 3, 0.2);
  EXPECT_NEAR(depth_at(Vec3(0, -93, 50)), 3, 0.2);
  EXPECT_EQ(depth_at(Vec3(150, 0, 115)), 0);
  EXPECT_GT(depth_at(Vec3(150, 0, 105)), 1);
}

TEST(CellErrors, AreAsLargeAsTheySay) {
  double field = 0, shift = 0, turn = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const RobotField error(0.3, seed);
    Random random(seed);
    const Pose drawn = drawn_motion(0.25, 0.02, random);
    shift += drawn.translation().squaredNorm();
    turn += vector_from_rotation(drawn.linear()).squaredNorm();
    for (int i = 0; i < 10; ++i, ++count)
      field += error.error_at(Vec3(random.uniform(-1e3, 1e3), random.uniform(-1e3, 1e3), random.uniform(0, 1e3)))
                   .squaredNorm();
    const Vec3 here(500, 100, 50);
    EXPECT_LT((error.error_at(here) - error.error_at(here + Vec3(5, 5, 5))).norm(), 0.1);  // smooth
  }
  EXPECT_NEAR(std::sqrt(field / count), 0.3, 0.03);
  EXPECT_NEAR(std::sqrt(shift / 300), 0.25, 0.02);
  EXPECT_NEAR(std::sqrt(turn / 300), 0.02, 0.002);
}

/// The example cell with a few batteries, the smallest of its parts.
struct SmallCell {
  SmallCell() : cell(read_work_cell(kSource / "examples/cells/pick_cell.toml")) {
    cell.parts = {cell.parts.back()};
    robot = read_robot(cell.robots.front().model);
    stock = make_cell_stock({read_cad(cell.parts.front().cad)});
  }
  WorkCell cell;
  robot::RobotModel robot;
  std::shared_ptr<const CellStock> stock;
};

/// A tool that looks down on a battery, across its short side.
Pose above(const PartTruth& battery) {
  const Matrix3& r = battery.base_from_part.linear();
  int up = 0;
  r.row(2).cwiseAbs().maxCoeff(&up);
  const int across = up == 1 ? 0 : 1;  // 66 mm, or 110 mm where it lies on a long side
  Pose tcp = Pose::Identity();
  tcp.linear().col(2) = -Vec3::UnitZ();
  Vec3 x = r.col(across);
  x.z() = 0;
  tcp.linear().col(0) = x.normalized();
  tcp.linear().col(1) = tcp.linear().col(2).cross(tcp.linear().col(0));
  tcp.translation() = battery.base_from_part * Vec3(0, 0, 45);
  return tcp;
}

/// A pick or a place: from above, at it, higher above.
robot::CycleResult run(SimulatedCell& cell, robot::Controller& controller, robot::CycleCommand command, int cycle,
                       const Pose& at) {
  robot::CycleOrder order;
  order.command = command;
  order.cycle = cycle;
  order.opening_mm = 140;
  for (const double lift : {150.0, 0.0, 250.0}) {
    Pose pose = at;
    pose.translation().z() += lift;
    order.positions.push_back(robot::position_from_pose(pose, 0, 1));
  }
  return run_cycle(controller, cell.clock(), order);
}

TEST(SimulatedCell, APickByTheHandshakeHoldsThePartAndAPlaceIsMeasured) {
  const SmallCell small;
  SimulatedCellOptions options;
  options.parts = 1;
  options.hand_eye_mm = options.hand_eye_rad = options.robot_mm = options.slip_mm = options.slip_rad = 0;
  options.seed = 4;
  SimulatedCell cell(small.cell, small.robot, small.stock, options);
  const auto controller = cell.connect();
  const PartTruth before = cell.truth().parts.front();
  EXPECT_EQ(before.where, Whereabouts::in_bin);
  const Pose tcp = above(before);
  const auto order = [&](robot::CycleCommand command, int cycle, const Pose& at) {
    return run(cell, *controller, command, cycle, at);
  };
  ASSERT_EQ(order(robot::CycleCommand::pick, 1, tcp), robot::CycleResult::done)
      << (cell.truth().failed_grips.empty() ? "" : cell.truth().failed_grips.back()) << '\n'
      << before.base_from_part.matrix();
  EXPECT_EQ(cell.truth().parts.front().where, Whereabouts::in_hand);
  const std::vector<picking::Slot> slots = picking::slots_of(*small.cell.rack);
  const Pose tcp_from_part = tcp.inverse() * before.base_from_part;
  // Where it would stand in slot 3, 2 mm off.
  Pose wanted = slots[2].base_from_slot;
  wanted.translation().x() += 2;
  ASSERT_EQ(order(robot::CycleCommand::place, 2, wanted * tcp_from_part.inverse()), robot::CycleResult::done);
  const PartTruth after = cell.truth().parts.front();
  EXPECT_EQ(after.where, Whereabouts::placed);
  EXPECT_EQ(after.slot, 3);
  EXPECT_NEAR(after.off_mm, 2, 0.5);
  EXPECT_LT(after.off_rad, 0.2 * kDegree);
  EXPECT_EQ(after.times_placed, 1);
}

TEST(SimulatedCell, APartInTheHandIsMeasured) {
  const SmallCell small;
  Part battery = compile_part(small.stock->meshes.front());
  battery.name = "battery";
  const grasp::GripperShape jaw = grasp::gripper_shape(small.cell.grippers.front());
  const Pose there = small.cell.in_hand->looks.front() * jaw.gripper.flange_from_tcp;
  for (const std::uint64_t seed : {4, 5, 6}) {
    SCOPED_TRACE(seed);
    SimulatedCellOptions options;
    options.parts = 1;
    options.hand_eye_mm = options.hand_eye_rad = options.robot_mm = 0;
    options.slip_mm = 1, options.slip_rad = 1 * kDegree;
    options.seed = seed;
    SimulatedCell cell(small.cell, small.robot, small.stock, options);
    const auto controller = cell.connect();
    const Pose tcp = above(cell.truth().parts.front());
    const Pose tcp_from_part = tcp.inverse() * cell.truth().parts.front().base_from_part;
    const auto look = [&](double opening_mm) {
      const Scan scan = std::get<Scan>(cell.camera().grab().content);
      return picking::look_at_hand(scan, base_from_camera(small.cell) * scan.input_from_camera, battery,
                                   {&jaw, opening_mm, there, tcp_from_part});
    };
    EXPECT_EQ(look(66).state, picking::HandSight::State::gone);  // nothing is there yet
    ASSERT_EQ(run(cell, *controller, robot::CycleCommand::pick, 1, tcp), robot::CycleResult::done);
    robot::CycleOrder show;
    show.command = robot::CycleCommand::way_points;
    show.cycle = 2;
    show.positions = {robot::position_from_pose(there, 0, 1)};
    ASSERT_EQ(run_cycle(*controller, cell.clock(), show), robot::CycleResult::done);
    const Pose truth = cell.truth().parts.front().base_from_part;
    const int across = std::abs(tcp.linear().col(0).dot(truth.linear().col(0))) > 0.9 ? 110 : 66;
    const picking::HandSight sight = look(across);
    ASSERT_EQ(sight.state, picking::HandSight::State::measured) << sight.why;
    const Vec3 middle = battery.box_center();
    EXPECT_LT((sight.look.base_from_part * middle - truth * middle).norm(), 0.25);
    EXPECT_LT(rotation_angle(sight.look.base_from_part.linear(), truth.linear()), 0.25 * kDegree);
  }
}

TEST(SimulatedCell, TheSameSeedIsTheSameCell) {
  const SmallCell small;
  SimulatedCellOptions options;
  options.parts = 3;
  options.at_walls = true;
  std::vector<Pose> first;
  for (int run = 0; run < 2; ++run) {
    SimulatedCell cell(small.cell, small.robot, small.stock, options);
    const std::vector<PartTruth> parts = cell.truth().parts;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (run == 0)
        first.push_back(parts[i].base_from_part);
      else
        EXPECT_EQ(parts[i].base_from_part.matrix(), first[i].matrix());
    }
  }
}

TEST(SimulatedCell, ACameraOnTheFlangeSeesFromWhereTheArmStands) {
  WorkCell work_cell = read_work_cell(kSource / "examples/cells/flange_cell.toml");
  work_cell.parts = {work_cell.parts.back()};
  const robot::RobotModel robot = read_robot(work_cell.robots.front().model);
  SimulatedCellOptions options;
  options.parts = 1;
  options.hand_eye_mm = options.hand_eye_rad = options.robot_mm = 0;
  SimulatedCell cell(work_cell, robot, make_cell_stock({read_cad(work_cell.parts.front().cad)}), options);
  const auto controller = cell.connect();
  const Gripper& gripper = work_cell.grippers.front();
  int cycle = 0;
  for (const Pose& look : work_cell.camera->looks) {
    SCOPED_TRACE(cycle);
    robot::CycleOrder order;
    order.command = robot::CycleCommand::way_points;
    order.cycle = ++cycle;
    order.positions = {robot::position_from_pose(look * gripper.flange_from_tcp, 0, 1)};
    ASSERT_EQ(run_cycle(*controller, cell.clock(), order), robot::CycleResult::done);
    const Scan scan = std::get<Scan>(cell.camera().grab().content);
    const Pose bin_from_camera =
        work_cell.bin->base_from_bin.inverse() * base_from_camera(work_cell, look) * scan.input_from_camera;
    int floor = 0, below = 0;
    for (int v = 0; v < scan.z_mm.height; v += 8)
      for (int u = 0; u < scan.z_mm.width; u += 8) {
        const double z = scan.z_mm(u, v);
        if (!(z > 0)) continue;
        const PinholeCamera& c = scan.camera;
        const Vec3 p = bin_from_camera * Vec3((u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z);
        if (std::abs(p.x()) > 300 || std::abs(p.y()) > 200) continue;
        floor += std::abs(p.z()) < 2;
        below += p.z() < -4;
      }
    EXPECT_GT(floor, 500);
    EXPECT_LT(below, floor / 50);
  }
}

TEST(SimulatedCell, AScanShowsWhichRoomIsEmpty) {
  const SmallCell small;
  SimulatedCellOptions options;
  options.parts = 3;
  options.hand_eye_mm = options.hand_eye_rad = 0;
  SimulatedCell cell(small.cell, small.robot, small.stock, options);
  const Scan scan = std::get<Scan>(cell.camera().grab().content);
  const Pose base_from_camera = tribin::base_from_camera(small.cell) * scan.input_from_camera;
  const auto seen = [&](const Pose& at, const Vec3& size) {
    return picking::look_into(scan, base_from_camera, at, size, small.cell.hand_eye.sigma_mm);
  };
  const Vec3 room(110, 66, 90);
  const Part part = compile_part(small.stock->meshes.front());
  for (const PartTruth& truth : cell.truth().parts) {
    Pose middle = truth.base_from_part;
    middle.translation() = middle * part.box_center();
    EXPECT_EQ(seen(middle, part.box_max - part.box_min), picking::RoomSeen::occupied);
    middle.translation().z() -= 250;
    EXPECT_EQ(seen(middle, room), picking::RoomSeen::hidden);  // below the floor
  }
  Pose above = small.cell.bin->base_from_bin;
  above.translation().z() += 350;
  EXPECT_EQ(seen(above, room), picking::RoomSeen::empty);
  Pose aside = Pose::Identity();
  aside.translation() = Vec3(1300, 1500, 100);
  EXPECT_EQ(seen(aside, room), picking::RoomSeen::hidden);  // out of view
}

TEST(SimulatedCell, TouchingThePartOrTheBinIsNoted) {
  const SmallCell small;
  SimulatedCellOptions options;
  options.parts = 1;
  SimulatedCell cell(small.cell, small.robot, small.stock, options);
  const auto controller = cell.connect();
  robot::CycleOrder order;
  order.command = robot::CycleCommand::way_points;
  const Vec3 part = cell.truth().parts.front().base_from_part.translation();
  int cycle = 0;
  const auto go_to = [&](const Vec3& at) {
    Pose pose = Pose::Identity();
    pose.linear() = rotation_from_vector(Vec3(kPi, 0, 0));
    pose.translation() = at;
    order.cycle = ++cycle;
    order.positions = {robot::position_from_pose(pose, 0, 1)};
    run_cycle(*controller, cell.clock(), order);
    return cell.truth().collisions.size();
  };
  EXPECT_EQ(go_to(Vec3(1300, 0, 500)), 0u);
  const std::size_t wall = go_to(Vec3(1300 + 280, 0, 100));  // the bin's half width is 280
  EXPECT_GT(wall, 0u);
  go_to(Vec3(1300, 0, 500));
  const std::size_t before = go_to(part + Vec3(0, 0, 300));
  EXPECT_GT(go_to(part + Vec3(75, 0, 30)), before);
}

}  // namespace
}  // namespace tribin::sim
