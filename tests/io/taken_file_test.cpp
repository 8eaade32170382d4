#include "tribin/io/taken_file.hpp"

#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/convert.hpp"
#include "tribin/io/scan_files.hpp"
#include "tribin/io/write.hpp"

namespace tribin {
namespace {

Taken some() {
  Taken taken;
  taken.time_ms = time_from_text("2026-11-22T11:15:03.250Z");
  taken.flange_time_ms = *taken.time_ms + 1500;
  taken.base_from_flange = robot_pose_from_text("yaskawa 600 -20.5 900 10 20 30");
  return taken;
}

bool same(const Taken& a, const Taken& b) {
  return a.time_ms == b.time_ms && a.flange_time_ms == b.flange_time_ms &&
         a.base_from_flange.has_value() == b.base_from_flange.has_value() &&
         (!a.base_from_flange || a.base_from_flange->isApprox(*b.base_from_flange, 1e-12));
}

Scan flat_scan() {
  Scan scan;
  scan.camera = {40, 30, 50, 50, 19.5, 14.5};
  scan.z_mm = Image<float>(40, 30, 800.f);
  return scan;
}

TEST(TakenFile, EveryScanFormatKeepsIt) {
  const test::TemporaryFolder folder;
  Scan scan = flat_scan();
  scan.taken = some();
  for (const std::string& extension : writable_scan_extensions()) {
    SCOPED_TRACE(extension);
    const auto path = folder.path() / ("of" + extension.substr(1) + extension);
    write_scan(path, scan);
    const ScanOrPoints read = read_scan_or_points(path);
    EXPECT_TRUE(std::visit([&](const auto& r) { return same(r.taken, scan.taken); }, read));
    const auto copy = folder.path() / ("copy_of" + extension.substr(1) + ".ply");
    convert(path, copy);
    EXPECT_TRUE(same(read_points(copy).taken, scan.taken));
  }
}

TEST(TakenFile, OfAnotherScanIsNotUsed) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "scan.pcd";
  Scan scan = flat_scan();
  scan.taken = some();
  write_scan(path, scan);
  scan.taken = {};
  scan.z_mm(3, 3) = 801;
  write_scan(path, scan);  // the file beside it stays
  const Scan read = read_scan(path);
  EXPECT_FALSE(read.taken.known());
  ASSERT_FALSE(read.warnings.empty());
  EXPECT_NE(read.warnings.back().find("scan_hash"), std::string::npos);
}

TEST(TakenFile, PosesOfRobotsAreRead) {
  const test::TemporaryFolder folder;
  const auto path = folder.write(
      "scan.taken.json",
      R"({"base_from_flange": {"convention": "yaskawa", "pose": [600, -20.5, 900, 10, 20, 30], "time": "2026-11-22T11:15:04.750Z"},
          "time": "2026-11-22T11:15:03.250Z"})");
  EXPECT_TRUE(same(read_taken_file(path), some()));
}

TEST(TakenFile, TimesReadAsTheyAreWritten) {
  for (const char* text : {"1970-01-01T00:00:00.000Z", "2024-02-29T23:59:59.999Z", "2026-11-22T11:15:03.250Z"})
    EXPECT_EQ(text_of_time(time_from_text(text)), text);
  EXPECT_EQ(time_from_text("1970-01-02T00:00:00.001Z"), 86'400'001);
  for (const char* text : {"", "2026-02-29T00:00:00.000Z", "2026-11-22T24:00:00.000Z", "2026-11-22T11:15:03Z",
                           "2026-11-22T11:15:03.250", "2026-11-22T11:15:03.250Z ", "22.11.2026"})
    EXPECT_THROW(time_from_text(text), Error) << text;
}

TEST(TakenFile, WhatCannotBeIsRefused) {
  const test::TemporaryFolder folder;
  for (const char* text :
       {"[]", "{\"tim\": 1}", "{\"time\": 3}", "{\"base_from_flange\": {}}",
        "{\"base_from_flange\": {\"convention\": \"abb\", \"pose\": [1, 2, 3, 4, 5, 6]}}",
        "{\"base_from_flange\": {\"translation_mm\": [0, 0, 0], \"rotation\": [[2,0,0],[0,1,0],[0,0,1]]}}"})
    EXPECT_THROW(read_taken_file(folder.write("bad.json", text)), Error) << text;
  for (const char* text : {"", "yaskawa", "yaskawa 1 2 3", "yaskawa 1 2 3 4 5 x", "robot 1 2 3 4 5 6"}) {
    try {
      robot_pose_from_text(text);
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::bad_option);
    }
  }
}

}  // namespace
}  // namespace tribin
