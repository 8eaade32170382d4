#include "tribin/config/robot_file.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "support/arms.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/config/work_cell.hpp"
#include "tribin/core/error.hpp"
#include "tribin/kinematics/inverse.hpp"
#include "tribin/robot/cell_limits.hpp"

namespace tribin {
namespace {

std::filesystem::path sample(const std::string& name) {
  return std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/robots" / (name + ".toml");
}

TEST(RobotFiles, OfTheExamplesAreRead) {
  for (const char* name : {"gp110", "sia20d", "sda10f", "sda20d"}) {
    SCOPED_TRACE(name);
    const robot::RobotModel robot = read_robot(sample(name));
    EXPECT_FALSE(robot.source.empty());
    const bool dual = std::string(name).starts_with("sda");
    EXPECT_EQ(robot.arms.size(), dual ? 2u : 1u);
    EXPECT_EQ(robot.waist.has_value(), dual);
    for (const robot::Arm& arm : robot.arms) {
      EXPECT_EQ(&arm_called(robot, arm.name), &arm);
      for (const robot::JointRange& joint : arm.joints) EXPECT_GT(joint.max_speed, 1);
    }
    EXPECT_THROW(arm_called(robot, "R9"), Error);
  }
}

TEST(RobotFiles, TheSampleCellNamesOneThatIsThere) {
  const WorkCell cell = read_work_cell(std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/cells/bench_cell.toml");
  ASSERT_FALSE(cell.robots.empty());
  EXPECT_EQ(read_robot(cell.robots[0].model).name, "SDA20D");
  const robot::SafetyLimits limits = robot::limits_of(cell);
  EXPECT_FALSE(limits.allow_arm);
  EXPECT_EQ(limits.speed_mm_s, 250);
  ASSERT_TRUE(limits.workspace);
  EXPECT_EQ(limits.workspace->max.x(), 1500);
}

TEST(RobotFiles, Gp110IsTheArmOfTheTests) {
  const robot::RobotModel robot = read_robot(sample("gp110"));
  test::Random random(1);
  const robot::Arm in_code = test::gp110();
  for (int i = 0; i < 50; ++i) {
    const robot::Joints joints = test::random_joints_in_limits(in_code, random);
    EXPECT_LE(test::relative_error(in_code, arm_from_flange(robot.arms[0], joints), arm_from_flange(in_code, joints)),
              1e-12);
    EXPECT_EQ(margins(robot.arms[0], joints).limit, margins(in_code, joints).limit);
  }
}

TEST(RobotFiles, TheArmsOfADualArmRobotMirrorEachOther) {
  for (const char* name : {"sda10f", "sda20d"}) {
    const robot::RobotModel robot = read_robot(sample(name));
    test::Random random(2);
    for (int i = 0; i < 50; ++i) {
      const robot::Joints joints = test::random_joints_in_limits(robot.arms[0], random);
      const Pose left = base_from_arm(robot, robot.arms[0]) * arm_from_flange(robot.arms[0], joints);
      const Pose right = base_from_arm(robot, robot.arms[1]) * arm_from_flange(robot.arms[1], joints);
      const Vec3 mirror(1, -1, 1);
      EXPECT_LE((left.translation().cwiseProduct(mirror) - right.translation()).norm(), 1e-9);
      EXPECT_LE((left.linear().col(2).cwiseProduct(mirror) - right.linear().col(2)).norm(), 1e-12);
    }
  }
  const robot::RobotModel sda10f = read_robot(sample("sda10f"));
  const Pose flange = base_from_arm(sda10f, sda10f.arms[0]) * arm_from_flange(sda10f.arms[0], {});
  EXPECT_LE((flange.translation() - Vec3(100, 265 + 360 + 360 + 155, 1200)).norm(), 1e-9);
}

TEST(RobotFiles, WhatIsToBeFilledInIsSaid) {
  try {
    read_robot(sample("da20"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::bad_input);
    const std::string message = error.what();
    EXPECT_NE(message.find("da20.toml: line"), std::string::npos) << message;
    EXPECT_NE(message.find("fill in"), std::string::npos) << message;
    EXPECT_NE(message.find("to be filled in from the robot's own papers"), std::string::npos) << message;
  }
}

TEST(RobotFiles, WrongOnesNameThePlace) {
  std::ifstream in(sample("gp110"));
  const std::string good((std::istreambuf_iterator<char>(in)), {});
  const test::TemporaryFolder folder;
  const auto message = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    const auto path = folder.path() / "robot.toml";
    std::ofstream(path) << text;
    try {
      read_robot(path);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("read");
  };
  EXPECT_EQ(message("GP110", "GP111"), "read");
  for (const auto& [from, to, wanted] :
       {std::tuple{"c2 = 870", "c2 = 0.87e9", "six.c2"}, std::tuple{"spherical_wrist_6", "srs_7", "[arm.seven]"},
        std::tuple{"sign = -1", "sign = 0.5", "1 or -1"}, std::tuple{"[-90, 155]", "[155, -90]", "least angle first"},
        std::tuple{"speed_deg_s = 140", "speed_deg_s = 0", "speed_deg_s"}, std::tuple{"source", "sauce", "sauce"},
        std::tuple{"name = \"T\"", "nome = \"T\"", "nome"}, std::tuple{"[[arm]]", "[[leg]]", "leg"}}) {
    const std::string text = message(from, to);
    EXPECT_NE(text.find(wanted), std::string::npos) << text;
    EXPECT_NE(text.find("robot.toml"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace tribin
