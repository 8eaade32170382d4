#include "tribin/io/rig_file.hpp"

#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/frames_file.hpp"

namespace tribin {
namespace {

const char* const kYaml = R"(%YAML:1.0
---
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1000., 0., 3.2e+02, 0., 1001., 240.,
       0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.1, 0.2, 0.001, 0.002, 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1002., 0., 321., 0., 1003., 241., 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 4
   dt: d
   data: [ 0., 0., 0., 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 0., -1., 0., 1., 0., 0., 0., 0., 1. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -10., 2., 3. ]
note: "not read"
)";

void refused(const std::function<void()>& action, const std::string& words) {
  try {
    action();
    FAIL() << "wanted: " << words;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::bad_input);
    EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
  }
}

TEST(RigFile, OpenCvYamlAndItsUnit) {
  const test::TemporaryFolder folder;
  folder.write("stereo.yml", kYaml);
  folder.write("rig.json", R"({"opencv": ["stereo.yml"], "unit_mm": 20, "names": ["a", "b"]})");
  const Rig rig = read_rig(folder.path() / "rig.json");
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_EQ(rig.cameras[1].name, "b");
  EXPECT_EQ(rig.cameras[0].camera.fy, 1001);
  EXPECT_EQ(rig.cameras[0].distortion[3], 0.002);
  // R, T map points of the first camera into the second.
  const Vec3 p = rig.cameras[1].rig_from_camera.inverse() * Vec3(1, 2, 3);
  EXPECT_LT((p - Vec3(-2 - 200, 1 + 40, 3 + 60)).norm(), 1e-12);
  EXPECT_EQ(read_rig(folder.path() / "stereo.yml").cameras[1].name, "right");
}

TEST(RigFile, WhatIsWrittenIsRead) {
  const test::TemporaryFolder folder;
  Rig rig = read_rig(folder.write("stereo.yml", kYaml));
  for (RigCamera& c : rig.cameras) c.camera.width = 640, c.camera.height = 480;
  rig.projector = rig.cameras[1];
  write_rig(folder.path() / "rig.json", rig);
  const Rig back = read_rig(folder.path() / "rig.json");
  EXPECT_EQ(back.cameras.size(), 2u);
  ASSERT_TRUE(back.projector);
  EXPECT_TRUE(back.projector->rig_from_camera.isApprox(rig.cameras[1].rig_from_camera, 0));
  EXPECT_EQ(back.cameras[0].distortion, rig.cameras[0].distortion);
  EXPECT_EQ(back.cameras[0].camera.width, 640);
}

TEST(RigFile, SaysWhatIsWrong) {
  const test::TemporaryFolder folder;
  const auto yaml = [&](std::string from, std::string to) {
    std::string text = kYaml;
    text.replace(text.find(from), from.size(), to);
    return folder.write("bad.yml", text);
  };
  refused([&] { read_rig(yaml("321., 0.", "321., x")); }, "line 14, M2: saw \"x\", wanted a number");
  refused([&] { read_rig(yaml("T: !!", "S: !!")); }, "no T");
  refused([&] { read_rig(yaml("1., 0., 0., 0., 0., 1. ]", "1., 0., 0., 0., 0., 2. ]")); }, "a rotation");
  refused([&] { read_rig(yaml("-10., 2., 3. ]", "-10., 2., 3. ")); }, "a closing ]");
  refused([&] { read_rig(yaml("rows: 1", "rows: 2")); }, "as many as rows x cols");
  refused([&] { read_rig(folder.write("r.json", R"({"cameras": []})")); }, "one camera or more");
  refused(
      [&] {
        read_rig(folder.write("r.json", R"({"cameras": [{"name": "a", "width": 3, "height": 2, "K": [1, 2]}]})"));
      },
      "cameras[0].K");
  refused([&] { read_rig(folder.write("r.json", "{")); }, "no JSON");
}

TEST(FramesFile, PatternsAreReadAsTheyWereWritten) {
  const test::TemporaryFolder folder;
  for (const PatternCode code : {PatternCode::gray, PatternCode::heterodyne, PatternCode::micro}) {
    const auto patterns = make_patterns({.code = code, .width = 320, .height = 40, .rows = true});
    write_patterns(folder.path() / "set", patterns, 320, 40);
    const std::vector<FrameStack> frames = read_frames(folder.path() / "set");
    ASSERT_EQ(frames.size(), 1u);
    ASSERT_EQ(frames[0].grey8.size(), patterns.size());
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      EXPECT_EQ(frames[0].patterns[i].kind, patterns[i].kind);
      EXPECT_EQ(frames[0].grey8[i].data, draw_pattern(patterns[i], 320, 40).data);
    }
    // A camera that is the projector sees its own columns.
    const Decoded d = decode(frames[0], {.image_noise = 0.3});
    for (int u = 4; u < 316; ++u) EXPECT_NEAR(d.column(u, 20), u, 0.05);
    for (int v = 4; v < 36; ++v) EXPECT_NEAR(d.row(160, v), v, 0.05);
  }
}

TEST(FramesFile, SaysWhatIsWrong) {
  const test::TemporaryFolder folder;
  const auto frames = [&](const std::string& entry) {
    folder.write("frames.json", R"({"cameras": [{"camera": "c", "patterns": [)" + entry + "]}]}");
    return [&folder] { read_frames(folder.path()); };
  };
  refused(frames(R"({"file": "a.png", "kind": "stripes"})"), "cameras[0].patterns[0].kind");
  refused(frames(R"({"file": "a.png", "kind": "phase", "period_px": 16})"), "shift_deg");
  refused(frames(R"({"file": "a.png", "kind": "gray"})"), "no \"period_px\", wanted the width of the words");
  refused(frames(R"({"file": "a.png", "kind": "white"})"), "a.png");
  refused([&] { read_frames(folder.path() / "none"); }, "frames.json");
}

}  // namespace
}  // namespace tribin
