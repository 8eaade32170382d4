#include "tribin/picking/place.hpp"

#include <gtest/gtest.h>

#include "support/fake_cell.hpp"
#include "tribin/config/robot_file.hpp"

namespace tribin::picking {
namespace {

TEST(PlanPlace, TheToolGoesBackUntilItStandsBeforeAllOfThePart) {
  const WorkCell cell = test::fake_work_cell();
  const robot::RobotModel robot = read_robot(cell.robots.front().model);
  ArmWithTool arm;
  arm.robot = &robot;
  arm.arm = &robot.arms.front();
  Gripper gripper = cell.grippers.front();
  gripper.finger_mm = Vec3(8, 12, 190);
  gripper.flange_from_tcp.translation() = Vec3(0, 0, 270);
  gripper.boxes = {{Vec3(0, 0, 30), Vec3(60, 60, 60)}};
  const grasp::GripperShape shape = grasp::gripper_shape(gripper);
  arm.flange_from_tcp = gripper.flange_from_tcp;
  const std::vector<Slot> slots = slots_of(*cell.rack);
  const std::vector<const Slot*> first = {&slots.front()};
  const Pose upright = Pose::Identity();
  for (const double height : {40.0, 100.0, 160.0}) {
    SCOPED_TRACE(height);
    Part part;
    part.box_min = Vec3(-20, -20, 0), part.box_max = Vec3(20, 20, height);
    Held held{&part, &shape, 60, test::looking_down(Vec3(0, 0, 15)).inverse()};  // by its foot
    const auto placing = plan_place(arm, held, first, std::span(&upright, 1), {});
    ASSERT_TRUE(placing);
    const Vec3 back = placing->stops[2].base_from_tcp.translation() - placing->stops[1].base_from_tcp.translation();
    EXPECT_NEAR(back.head<2>().norm(), 0, 1e-9);
    EXPECT_GE(back.z(), 100);
    EXPECT_GT(15 - gripper.tip_mm + back.z(), height);  // the tips are above the part
  }
}

}  // namespace
}  // namespace tribin::picking
