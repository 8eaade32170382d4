#include "tribin/io/part_cache.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "support/solids.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/log.hpp"
#include "tribin/io/write.hpp"
#include "tribin/part/part_file.hpp"

namespace tribin {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> entries(const fs::path& folder) {
  std::vector<fs::path> out;
  if (fs::exists(folder))
    for (const auto& entry : fs::directory_iterator(folder)) out.push_back(entry.path());
  return out;
}

fs::path box_file(const test::TemporaryFolder& folder, const std::string& name, float height) {
  Mesh mesh;
  test::add_box(mesh, {0, 0, 0}, {40, 30, height});
  write_mesh(folder.path() / name, mesh);
  return folder.path() / name;
}

class PartCache : public testing::Test {
 protected:
  void SetUp() override {
    set_log_sink([this](LogLevel level, const std::string& text) {
      if (level == LogLevel::warning) warnings_.push_back(text);
    });
  }
  void TearDown() override { set_log_sink({}); }

  Part read(const fs::path& path, bool expect_loaded, LengthUnit unit = LengthUnit::automatic) {
    StageTimes times;
    Part part = read_part(path, {.cad = {.unit = unit}, .name = {}, .cache = cache_}, &times);
    EXPECT_EQ(times.of("compile") == 0, expect_loaded) << path;
    return part;
  }

  test::TemporaryFolder folder_;
  fs::path cache_ = folder_.path() / "cache" / "parts";
  std::vector<std::string> warnings_;
};

TEST_F(PartCache, TheSecondReadingIsTheFirst) {
  const fs::path file = box_file(folder_, "box.stl", 20);
  const Part compiled = read(file, false), loaded = read(file, true), plain = read_part(file);
  EXPECT_EQ(bytes_of_part(loaded, {}), bytes_of_part(compiled, {}));
  EXPECT_EQ(bytes_of_part(loaded, {}), bytes_of_part(plain, {}));
  EXPECT_EQ(entries(cache_).size(), 1u);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(PartCache, AnotherContentUnitOrFormatIsAnotherPart) {
  const fs::path file = box_file(folder_, "box.stl", 20);
  read(file, false);
  EXPECT_EQ(read(file, false, LengthUnit::centimetre).box_max.x(), 400);
  read(box_file(folder_, "box.ply", 20), false);
  box_file(folder_, "box.stl", 25);
  EXPECT_EQ(read(file, false).box_max.z(), 25);
  fs::copy(file, folder_.path() / "copy.stl");
  EXPECT_EQ(read(folder_.path() / "copy.stl", true).name, "copy");
  EXPECT_EQ(entries(cache_).size(), 4u);
}

TEST_F(PartCache, ASpoiltEntryIsSaidAndMadeAnew) {
  const fs::path file = box_file(folder_, "box.stl", 20);
  const Part compiled = read(file, false);
  const fs::path entry = entries(cache_).at(0);
  for (const std::uintmax_t size : {std::uintmax_t{0}, std::uintmax_t{100}, fs::file_size(entry) - 1}) {
    fs::resize_file(entry, size);
    EXPECT_EQ(bytes_of_part(read(file, false), {}), bytes_of_part(compiled, {}));
    EXPECT_EQ(warnings_.size(), 1u);
    warnings_.clear();
    read(file, true);
  }
}

TEST_F(PartCache, AFolderThatCannotBeIsNoError) {
  cache_ = folder_.write("file", "in the way") / "parts";
  read(box_file(folder_, "box.stl", 20), false);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(PartCache, BadFilesAreRefusedAsWithoutIt) {
  EXPECT_THROW(read(folder_.path() / "none.stl", false), Error);
  EXPECT_THROW(read(folder_.write("a.abc", "text"), false), Error);
  EXPECT_THROW(read(folder_.write("a.stl", "text"), false), Error);
  EXPECT_TRUE(entries(cache_).empty());
}

}  // namespace
}  // namespace tribin
