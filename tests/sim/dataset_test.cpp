#include "tribin/sim/dataset.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "io/png.hpp"
#include "sim/foreign_objects.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin::sim {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

nlohmann::json json_of(const fs::path& path) { return nlohmann::json::parse(std::ifstream(path)); }

Image<std::uint16_t> png_of(const fs::path& path) { return io::decode_png16(io::read_file(path)); }

class BinDataset : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"whole", "resumed"}) fs::remove_all(folder(name));
    options_.parts = foreign_objects(60);
    options_.kind = SceneKind::bin;
    options_.seed = 11;
  }
  void TearDown() override {
    for (const char* name : {"whole", "resumed"}) fs::remove_all(folder(name));
  }
  static fs::path folder(const std::string& name) {
    return fs::path(testing::TempDir()) / ("tribin_bin_" + std::to_string(::getpid()) + name);
  }
  DatasetOptions options_;
};

TEST_F(BinDataset, HoldsNoPartWhereNoneIsWanted) {
  for (const SceneKind kind : {SceneKind::empty, SceneKind::foreign}) {
    fs::remove_all(folder("whole"));
    options_.kind = kind;
    simulate_dataset(options_, folder("whole"));
    EXPECT_TRUE(json_of(folder("whole") / "test/000001/scene_gt.json").at("0").empty());
    const int foreign = json_of(folder("whole") / "scene_info.json").at("1").at("foreign");
    EXPECT_EQ(foreign > 0, kind == SceneKind::foreign);
  }
}

TEST_F(BinDataset, TellsTheBoundOfEachPartAndTheScalesError) {
  options_.parts = {foreign_objects(60).front()};  // a block: it has a bound where it leans and shows three faces
  options_.level = Level::dense;
  options_.systematic = 0;
  options_.scale_error = 0.001;
  simulate_dataset(options_, folder("whole"));
  const fs::path scene = folder("whole") / "test/000001";
  const double scale = json_of(scene / "scene_info.json").at("scale");
  EXPECT_GT(std::abs(scale - 1), 1e-6);
  EXPECT_LT(std::abs(scale - 1), 0.005);
  EXPECT_DOUBLE_EQ(json_of(scene / "scene_camera.json").at("0").at("scale_error").get<double>(), 0.001);
  int bounded = 0;
  const nlohmann::json info = json_of(scene / "scene_gt_info.json");
  for (const nlohmann::json& part : info.at("0")) bounded += part.contains("bound_mm");
  EXPECT_GT(bounded, 0);
}

TEST_F(BinDataset, GoesOnWhereItWasBrokenOff) {
  options_.scenes = 2;
  simulate_dataset(options_, folder("whole"));
  options_.scenes = 1;
  simulate_dataset(options_, folder("resumed"));
  const auto made = fs::last_write_time(folder("resumed") / "test/000001/depth/000000.png");
  fs::create_directories(unfinished_scenes(folder("resumed")) / "000002/depth");  // as a killed run leaves it
  options_.scenes = 2;
  set_thread_count(1);
  simulate_dataset(options_, folder("resumed"));
  set_thread_count(0);
  EXPECT_EQ(fs::last_write_time(folder("resumed") / "test/000001/depth/000000.png"), made) << "made once";
  EXPECT_FALSE(fs::exists(unfinished_scenes(folder("resumed"))));
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder("whole"))) {
    if (!entry.is_regular_file()) continue;
    const fs::path twin = folder("resumed") / fs::relative(entry.path(), folder("whole"));
    EXPECT_EQ(bytes_of(entry.path()), bytes_of(twin)) << twin;
    ++files;
  }
  EXPECT_GT(files, 20);
  options_.seed = 12;
  EXPECT_THROW(simulate_dataset(options_, folder("whole")), Error) << "another data set";
}

TEST_F(BinDataset, TruthAgreesWithItself) {
  simulate_dataset(options_, folder("whole"));
  const fs::path scene = folder("whole") / "test/000001";
  const auto gt = json_of(scene / "scene_gt.json")["0"], info = json_of(scene / "scene_gt_info.json")["0"];
  const auto label = png_of(scene / "truth/label.png"), depth = png_of(scene / "truth/depth.png"),
             face = png_of(scene / "truth/face.png");
  ASSERT_GE(gt.size(), 3u);
  std::vector<int> count(gt.size() + 1, 0);
  for (std::size_t i = 0; i < label.size(); ++i) {
    ++count.at(label.data[i]);
    EXPECT_EQ(label.data[i] > 0, depth.data[i] > 0);
    EXPECT_EQ(label.data[i] > 0, face.data[i] > 0);
  }
  for (std::size_t k = 0; k < gt.size(); ++k) {
    EXPECT_EQ(count[k + 1], info[k]["px_count_visib"]);
    EXPECT_NEAR(info[k]["visib_fract"].get<double>(), count[k + 1] / info[k]["px_count_all"].get<double>(), 1e-12);
    char mask[64];
    std::snprintf(mask, sizeof mask, "mask_visib/000000_%06zu.png", k);
    EXPECT_TRUE(fs::exists(scene / mask));
  }
  const auto scene_info = json_of(folder("whole") / "scene_info.json")["1"];
  EXPECT_LE(scene_info["max_overlap_mm"].get<double>(), 0.5);
  EXPECT_EQ(scene_info["kind"], "bin");
}

}  // namespace
}  // namespace tribin::sim
