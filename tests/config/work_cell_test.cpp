#include "tribin/config/work_cell.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/kinematics/rotation_conventions.hpp"

namespace tribin {
namespace {

const std::filesystem::path kSource = TRIBIN_SOURCE_DIR;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::ostringstream out;
  out << file.rdbuf();
  return out.str();
}

/// What reading this text complains of; empty where it does not.
std::string complaint(const std::string& text, ErrorCode code = ErrorCode::bad_input) {
  const test::TemporaryFolder folder;
  const auto path = folder.write("cell.toml", text);
  try {
    read_work_cell(path);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), code) << e.what();
    const std::string message = e.what();
    EXPECT_EQ(message.find(path.string() + ": "), 0u) << message;
    return message.substr(path.string().size() + 2);
  }
  return "";
}

constexpr const char* kCamera = "[camera]\nfile = \"camera.json\"\n";

TEST(WorkCell, TheExampleIsRead) {
  const WorkCell cell = read_work_cell(kSource / "examples/cells/bench_cell.toml");
  ASSERT_TRUE(cell.camera);
  EXPECT_EQ(cell.mount(), CameraMount::fixed);
  EXPECT_TRUE(std::filesystem::exists(cell.camera->file));
  EXPECT_NEAR(cell.hand_eye.sigma_rad, 0.02 * kDegree, 1e-12);
  ASSERT_TRUE(cell.bin);
  // The camera looks down on the middle of the bin's floor: its z axis is the base's -z.
  EXPECT_LT((base_from_camera(cell) * Vec3(0, 0, 1200) - cell.bin->base_from_bin.translation()).norm(), 1e-9);
  EXPECT_EQ(cell.bin->inner_size_mm, Vec3(460, 360, 200));
  ASSERT_EQ(cell.grippers.size(), 1u);
  EXPECT_EQ(cell.grippers[0].boxes.size(), 1u);
  EXPECT_EQ(cell.grippers[0].flange_from_tcp.translation(), Vec3(0, 0, 210));
  ASSERT_EQ(cell.parts.size(), 2u);
  for (const CellPart& part : cell.parts) EXPECT_TRUE(std::filesystem::exists(part.cad)) << part.cad;
  EXPECT_NEAR(cell.parts[1].max_tilt_rad, 50 * kDegree, 1e-12);
  ASSERT_TRUE(cell.rack);
  EXPECT_EQ(cell.rack->slots.columns, 4);
  ASSERT_EQ(cell.robots.size(), 1u);
  EXPECT_EQ(cell.robots[0].controller.port, 80);
  EXPECT_FALSE(cell.safety.allow_arm);
  ASSERT_TRUE(cell.safety.workspace_mm);
  EXPECT_EQ(cell.safety.workspace_mm->max, Vec3(1500, 1500, 1800));
}

TEST(WorkCell, EveryKeyOfTheContractIsKnown) {
  EXPECT_EQ(complaint(R"toml(
[camera]
file = "camera.json"
mount = "fixed"                 # fixed | hand
[hand_eye]
base_from_camera = {translation_mm = [0, 0, 1200], rotation_deg = {convention = "yaskawa", values = [180, 0, 0]}, sigma_mm = 0.25, sigma_deg = 0.02}   # hand: flange_from_camera
[bin]
base_from_bin = {translation_mm = [600, 0, 0], rotation_deg = {convention = "yaskawa", values = [0, 0, 0]}}
inner_size_mm = [460, 360, 200]
wall_mm = 8
[[gripper]]
name = "jaw"
kind = "parallel_outside"       # parallel_inside | three_jaw | suction | magnet
stroke_mm = [0, 120]
force_n = 150
flange_from_tcp = {translation_mm = [0, 0, 180]}
boxes = [{center_mm = [0, 0, 90], size_mm = [80, 40, 180]}]
cylinders = []
[[part]]
name = "alternator_a"
cad = "alternator_a.step"
unit = "mm"
mass_kg = 5.2
grippers = ["jaw"]
max_tilt_deg = 40
pick_points = []
[rack]
base_from_rack = {translation_mm = [0, 700, 0]}
slots = {rows = 3, columns = 4, layers = 1, pitch_mm = [180, 180, 0], stagger_mm = 0}
sequence = ["alternator_a", "alternator_b"]
chamfer_mm = 3
[[robot]]
model = "sda20d.toml"
controller = {kind = "nx100", address = "127.0.0.1", port = 80}
speed_cap_mm_s = 250
[safety]
allow_arm = false
workspace_mm = {min = [-1000, -1000, 0], max = [1500, 1500, 1800]}
forbidden_mm = []
scan_max_age_s = 10
)toml"),
            "");
}

TEST(WorkCell, EveryConventionReadsAsTheSameRotation) {
  const Matrix3 rotation = robot::rotation_from_yaskawa(Vec3(10, 20, 30));
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  for (const robot::Convention convention : robot::kConventions) {
    SCOPED_TRACE(robot::name_of(convention));
    const std::vector<double> numbers = robot::numbers_from_pose(convention, pose);
    std::ostringstream text;
    text.precision(17);
    text << kCamera << "[hand_eye]\nbase_from_camera = {rotation_deg = {convention = \"" << name_of(convention)
         << "\", values = [";
    for (std::size_t i = 3; i < numbers.size(); ++i) text << (i > 3 ? ", " : "") << numbers[i];
    text << "]}}\n";
    const test::TemporaryFolder folder;
    const WorkCell cell = read_work_cell(folder.write("cell.toml", text.str()));
    EXPECT_LT((cell.hand_eye.parent_from_camera.linear() - rotation).norm(), 1e-9);
  }
}

TEST(WorkCell, ABinAloneIsRead) {
  const test::TemporaryFolder folder;
  const auto path = folder.write(
      "bin.toml", "[bin]\nbase_from_bin = {translation_mm = [0, 0, 900]}\ninner_size_mm = [400, 300, 150]\n");
  const WorkCell cell = read_bin(path);
  ASSERT_TRUE(cell.bin);
  EXPECT_EQ(cell.bin->wall_mm, 8);
  EXPECT_TRUE(base_from_camera(cell).isApprox(Pose::Identity()));
  EXPECT_THROW(read_work_cell(path), Error);  // no [camera]
  EXPECT_THROW(read_bin(folder.write("none.toml", kCamera)), Error);
}

TEST(WorkCell, PosesLeftOutAreTheIdentity) {
  const test::TemporaryFolder folder;
  const WorkCell cell =
      read_work_cell(folder.write("cell.toml", std::string(kCamera) + "[bin]\ninner_size_mm = [4, 3, 1]\n[rack]\n"));
  EXPECT_TRUE(cell.hand_eye.parent_from_camera.isApprox(Pose::Identity()));
  EXPECT_TRUE(cell.bin->base_from_bin.isApprox(Pose::Identity()));
  EXPECT_TRUE(cell.rack->base_from_rack.isApprox(Pose::Identity()));
}

TEST(WorkCell, ComplaintsNameLineAndColumn) {
  EXPECT_EQ(complaint("[camera]\nfile = \"c.json\"\nmont = \"hand\"\n"),
            "line 3, column 1: camera: saw the key \"mont\", wanted one of file, mount, keep_out_mm, looks");
  EXPECT_EQ(complaint("[camera]\nfile = 7\n"),
            "line 2, column 8: camera.file: saw 7, wanted the name of a file, in quotes");
  EXPECT_EQ(complaint("[camera]\nfile = \"c\"\nmount = \"wall\"\n"),
            "line 3, column 9: camera.mount: saw \"wall\", wanted one of fixed, hand");
  EXPECT_EQ(complaint("[camera]\n"), "line 1, column 1: camera: saw no file, wanted it to be there");
  EXPECT_EQ(complaint(std::string(kCamera) + "[bin]\ninner_size_mm = [460, \"wide\", 200]\n"),
            "line 4, column 23: bin.inner_size_mm[1]: saw \"wide\", wanted one of 3 numbers in > 0 .. 10000");
  EXPECT_EQ(complaint(std::string(kCamera) + "[safety]\nallow_arm = 1\n"),
            "line 4, column 13: safety.allow_arm: saw 1, wanted true or false");
  EXPECT_EQ(complaint(std::string(kCamera) + "[[robot]]\nmodel = \"a.toml\"\ncontroller = {port = 80.5}\n"),
            "line 5, column 22: robot[0].controller.port: saw 80.5, wanted a whole number in 1 .. 65535");
  EXPECT_EQ(complaint("[camera\n").substr(0, 8), "line 1, ");
  EXPECT_EQ(complaint("[bin]\ninner_size_mm = [1, 1, 1]\n"), "top level: saw no [camera], wanted it to be there");
}

TEST(WorkCell, WhatCannotBeIsRefused) {
  const std::string camera = kCamera,
                    gripper = "[[gripper]]\nname = \"jaw\"\nkind = \"three_jaw\"\nstroke_mm = [0, 90]\n";
  const auto part = [](const std::string& name, const std::string& more) {
    return "[[part]]\nname = \"" + name + "\"\ncad = \"a.step\"\n" + more;
  };
  EXPECT_EQ(complaint(camera + gripper + part("a", "grippers = [\"jaw\"]\n")), "");
  for (const std::string& wrong : {
           camera + gripper + part("a", "grippers = [\"claw\"]\n"),
           camera + gripper + gripper,
           camera + part("a", "") + part("a", ""),
           camera + part("a", "unit = \"yard\"\n"),
           camera + part("a", "pick_points = [{gripper = \"jaw\"}]\n"),
           camera + part("a", "mass_kg = nan\n"),
           camera + part("", ""),
           camera + "[rack]\nslots = {rows = 2}\n",
           camera + "[[gripper]]\nname = \"jaw\"\nkind = \"parallel_inside\"\nstroke_mm = [90, 10]\n",
           camera + "[safety]\nworkspace_mm = {min = [0, 0, 0], max = [1, 1, 0]}\n",
           camera + "[hand_eye]\nflange_from_camera = {}\n",
           camera + "mount = \"hand\"\n[hand_eye]\nbase_from_camera = {}\n",
           camera + "[hand_eye]\nbase_from_camera = {rotation_deg = {convention = \"abb\", values = [0, 0, 0]}}\n",
           camera + "[hand_eye]\nbase_from_camera = {rotation_deg = {convention = \"abb\", values = [0, 0, 0, 0]}}\n",
           camera + "[hand_eye]\nbase_from_camera = {rotation_deg = {values = [0, 0, 0]}}\n",
           camera + "[bin]\ninner_size_mm = [460, 360, 0]\n",
           camera + "[bin]\ninner_size_mm = [460, 360]\n",
           camera + "[robot]\nmodel = \"a.toml\"\n",
           camera + camera,
       }) {
    SCOPED_TRACE(wrong);
    EXPECT_NE(complaint(wrong), "");
  }
  EXPECT_NE(
      complaint(
          camera + "[hand_eye]\nbase_from_camera = {rotation_deg = {convention = \"ur\", values = [180, 0, 0]}}\n",
          ErrorCode::out_of_range),
      "");
}

TEST(WorkCell, ASequenceMayNameAPartThatIsNotThereYet) {
  const test::TemporaryFolder folder;
  const WorkCell cell =
      read_work_cell(folder.write("cell.toml", std::string(kCamera) + "[rack]\nsequence = [\"a\"]\n"));
  ASSERT_EQ(cell.warnings.size(), 1u);
  EXPECT_EQ(cell.warnings[0], "rack.sequence[0]: there is no part \"a\"");
}

TEST(WorkCell, ACameraOnTheFlangeNeedsTheFlange) {
  const test::TemporaryFolder folder;
  const WorkCell cell = read_work_cell(folder.write(
      "cell.toml",
      std::string(kCamera) + "mount = \"hand\"\n[hand_eye]\nflange_from_camera = {translation_mm = [1, 2, 3]}\n"));
  EXPECT_THROW(base_from_camera(cell), Error);
  Pose base_from_flange = Pose::Identity();
  base_from_flange.translation() = Vec3(100, 0, 0);
  EXPECT_EQ(base_from_camera(cell, base_from_flange).translation(), Vec3(101, 2, 3));
}

TEST(WorkCell, ThePageShowsTheKeys) {
  const std::string page = text_of(kSource / "docs/work_cell.md");
  EXPECT_NE(page.find(work_cell_keys()), std::string::npos) << "docs/work_cell.md must hold this table:\n"
                                                            << work_cell_keys();
}

}  // namespace
}  // namespace tribin
