#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tribin/cad/measure.hpp"
#include "tribin/cad_exchange/read_step.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin {
namespace {

namespace fs = std::filesystem;
const fs::path kParts = TRIBIN_SOURCE_DIR "/examples/parts";

std::string bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Alternators, TheCommittedFilesAreWhatTheProgramWrites) {
  const fs::path directory = fs::temp_directory_path() / ("tribin_alternators_" + std::to_string(::getpid()));
  ASSERT_EQ(std::system((std::string(TRIBIN_MAKE_ALTERNATORS) + " " + directory.string() + " > /dev/null").c_str()), 0);
  std::uintmax_t total = 0;
  for (const std::string part : {"alternator_a", "alternator_b", "battery"})
    for (const std::string extension : {".step", ".stl", ".dxf"}) {
      EXPECT_TRUE(bytes(directory / (part + extension)) == bytes(kParts / (part + extension))) << part << extension;
      total += fs::file_size(kParts / (part + extension));
    }
  EXPECT_LT(total, 9u << 18);
  fs::remove_all(directory);
}

TEST(Alternators, StepStlAndDxfAreOnePart) {
  register_cad_exchange();
  for (const std::string part : {"alternator_a", "alternator_b", "battery"}) {
    SCOPED_TRACE(part);
    const Mesh step = read_cad(kParts / (part + ".step"));
    EXPECT_LE(step.triangles.size(), 24000u);
    EXPECT_FALSE(step.faces.empty());
    const Box exact = bounding_box(step.vertices);
    for (const std::string extension : {".stl", ".dxf"}) {
      SCOPED_TRACE(extension);
      const Mesh mesh = read_cad(kParts / (part + extension));
      EXPECT_TRUE(mesh.oriented);
      const Box box = bounding_box(mesh.vertices);
      EXPECT_LT((box.min - exact.min).norm() + (box.max - exact.max).norm(), 0.5);  // the chord error, both sides
      EXPECT_NEAR(signed_volume(mesh), signed_volume(step), 0.01 * signed_volume(step));
    }
  }
}

TEST(Alternators, AreAlikeInSizeAndDifferentInRadii) {
  const Mesh a = read_step((kParts / "alternator_a.step").string()),
             b = read_step((kParts / "alternator_b.step").string());
  EXPECT_LT((bounding_box(a.vertices).size() - bounding_box(b.vertices).size()).norm(), 20);
  const auto has = [](const Mesh& mesh, double radius) {
    for (const CadFace& f : mesh.faces)
      if (f.type == SurfaceType::cylinder && !f.concave && std::abs(f.radius_mm - radius) < 1e-6) return true;
    return false;
  };
  for (const double radius : {40.0, 50.0, 52.5, 54.0, 28.0}) EXPECT_TRUE(has(a, radius) && !has(b, radius)) << radius;
  for (const double radius : {45.0, 52.0, 48.5, 53.0, 34.0}) EXPECT_TRUE(has(b, radius) && !has(a, radius)) << radius;
}

}  // namespace
}  // namespace tribin
