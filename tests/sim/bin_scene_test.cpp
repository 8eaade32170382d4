#include "tribin/sim/bin_scene.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "sim/foreign_objects.hpp"
#include "sim/random.hpp"
#include "sim/solid.hpp"
#include "tribin/core/error.hpp"
#include "tribin/io/cad_files.hpp"

namespace tribin::sim {
namespace {

/// A block, a bar, a tube, a hexagon and an angle of some 50 mm.
struct Things {
  std::vector<Mesh> meshes = foreign_objects(60);
  std::vector<Solid> solids;
  Things() {
    for (const Mesh& m : meshes) solids.emplace_back(m);
  }
  std::vector<const Solid*> many(int count) const {
    std::vector<const Solid*> list;
    for (int i = 0; i < count; ++i) list.push_back(&solids[i % solids.size()]);
    return list;
  }
};

const Things& things() {
  static const Things all;  // made once for all tests: a second
  return all;
}

Pose shifted(double x, double y, double z) {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3(x, y, z);
  return pose;
}

TEST(DistanceField, IsTheDistanceToThePart) {
  Random random(5);
  for (std::size_t k = 0; k < things().solids.size(); ++k) {
    SCOPED_TRACE(things().meshes[k].name);
    const Solid::State& s = things().solids[k].state();
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p(random.uniform(-40, 70), random.uniform(-40, 70), random.uniform(-30, 70));
      const double exact = s.exact.signed_distance(p);
      // Fine cells near the surface, where contacts are; the sign is right everywhere.
      const double read = s.field.at(p.cast<float>());
      if (std::abs(exact) < 1.5) {
        EXPECT_NEAR(read, exact, 0.5 * s.field.cell_mm());
      } else {
        EXPECT_EQ(read > 0, exact > 0);
      }
      EXPECT_LE(s.field.lower_bound(p.cast<float>()), exact + 1e-3);
    }
  }
}

TEST(DistanceField, IsNearZeroOnEveryFaceOfAnAlternator) {
  const Mesh mesh = read_cad(std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/parts/alternator_a.stl");
  const DistanceField field(mesh);
  Random random(7);
  double sum = 0;
  int n = 0;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 4; ++i, ++n) {
      double a = random.uniform(), b = random.uniform();
      if (a + b > 1) a = 1 - a, b = 1 - b;
      const Vec3f &o = mesh.vertices[t[0]], &u = mesh.vertices[t[1]], &w = mesh.vertices[t[2]];
      const Vec3f p = o + static_cast<float>(a) * (u - o) + static_cast<float>(b) * (w - o);
      EXPECT_LE(std::abs(field.at(p)), 0.5);
      sum += std::abs(field.at(p));
    }
  EXPECT_LE(sum / n, 0.06);
}

TEST(Overlap, IsHowDeepOnePartLiesInTheOther) {
  const Things& t = things();
  const Solid &block = t.solids[0], &bar = t.solids[1], &tube = t.solids[2];
  // The block is 30 x 18 x 12 mm from its corner: two of them, one shifted along x.
  for (const double depth : {0.2, 0.5, 2.0})
    EXPECT_NEAR(overlap_mm(block, Pose::Identity(), block, shifted(30 - depth, 3, 2)), depth, 0.02);
  EXPECT_EQ(overlap_mm(block, Pose::Identity(), block, shifted(30.01, 0, 0)), 0);
  // The bar of radius 5.4 mm within the tube of inner radius 12 mm: nothing touches until it is 6.6 mm off the axis.
  EXPECT_EQ(overlap_mm(bar, Pose::Identity(), tube, Pose::Identity()), 0) << "the hole is empty";
  EXPECT_EQ(overlap_mm(bar, shifted(6.5, 0, -5), tube, Pose::Identity()), 0);
  EXPECT_NEAR(overlap_mm(bar, shifted(7.6, 0, -5), tube, Pose::Identity()), 1, 0.05);
}

TEST(FillBin, PartsComeToRestInsideWithoutOverlap) {
  constexpr double kLength = 160, kWidth = 120;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const auto parts = things().many(12);
    const BinFill fill = fill_bin(parts, kLength, kWidth, seed);
    ASSERT_EQ(fill.bin_from_part.size(), parts.size());
    EXPECT_LE(fill.max_overlap_mm, 0.5);
    EXPECT_EQ(fill.drift_mm, 0) << "at rest";
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const Pose& pose = fill.bin_from_part[i];
      EXPECT_NEAR(pose.linear().determinant(), 1, 1e-9);
      double lowest = 1e9;
      for (const Vec3f& v : parts[i]->mesh().vertices) {
        const Vec3 p = pose * Vec3(v.cast<double>());
        lowest = std::min(lowest, p.z());
        EXPECT_TRUE(std::abs(p.x()) <= kLength / 2 + 0.5 && std::abs(p.y()) <= kWidth / 2 + 0.5 && p.z() >= -0.5);
      }
      // Nothing hangs in the air: 1 mm lower it would lie in the floor or in another part.
      bool held = lowest < 1;
      const Pose lower = shifted(0, 0, -1) * pose;
      for (std::size_t k = 0; k < parts.size() && !held; ++k)
        held = k != i && overlap_mm(*parts[i], lower, *parts[k], fill.bin_from_part[k]) > 0;
      EXPECT_TRUE(held) << "part " << i;
    }
  }
}

TEST(FillBin, TheSameSeedGivesTheSameBytes) {
  const auto parts = things().many(8);
  const auto poses = [&](std::uint64_t seed) {
    std::vector<double> numbers;
    for (const Pose& pose : fill_bin(parts, 160, 120, seed).bin_from_part)
      numbers.insert(numbers.end(), pose.matrix().data(), pose.matrix().data() + 16);
    return numbers;
  };
  const auto one = poses(3), again = poses(3), other = poses(4);
  EXPECT_EQ(std::memcmp(one.data(), again.data(), one.size() * sizeof(double)), 0);
  EXPECT_NE(std::memcmp(one.data(), other.data(), one.size() * sizeof(double)), 0);
}

TEST(FillBin, RefusesPartsThatDoNotFit) { EXPECT_THROW(fill_bin(things().many(1), 160, 20, 1), Error); }

}  // namespace
}  // namespace tribin::sim
