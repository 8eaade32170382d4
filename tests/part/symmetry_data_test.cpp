// Symmetries of real parts, from the shared data.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "part/shapes.hpp"
#include "tribin/io/cad_files.hpp"
#include "tribin/part/symmetry.hpp"

namespace tribin {
namespace {

namespace fs = std::filesystem;

fs::path data_root() {
  const char* root = std::getenv("TRIBIN_DATA");
  return root ? fs::path(root) : fs::path(TRIBIN_SOURCE_DIR) / "../shared/data";
}

#define TRIBIN_NEEDS(path) \
  if (!fs::exists(path)) GTEST_SKIP() << (path) << " is not there (set TRIBIN_DATA)"

/// The self-similar pose nearest to a rotation about an axis; nullptr if none is within half a degree.
const SelfSimilarPose* find_turn(const SymmetryResult& found, const Vec3& axis, double angle_deg) {
  const Matrix3 wanted = rotation_from_vector(axis * angle_deg * kDegree);
  for (const SelfSimilarPose& s : found.self_similar)
    if (rotation_angle(s.part_from_part.linear(), wanted) < 0.5 * kDegree) return &s;
  return nullptr;
}

TEST(FindSymmetriesOfRealParts, BearingHousingIsNearlyFourfold) {
  const fs::path path = data_root() / "scenes_dev/models/obj_000005.ply";
  TRIBIN_NEEDS(path);
  const auto found = find_symmetries(read_cad(path));
  EXPECT_EQ(found.group.discrete.size(), 1u) << "one hole tells the quarter turns apart";
  EXPECT_TRUE(found.group.continuous.empty());
  for (const double angle : {90.0, -90.0, 180.0}) {  // near_symmetries_discrete of models_info.json
    const auto* pose = find_turn(found, Vec3::UnitX(), angle);
    ASSERT_NE(pose, nullptr) << angle;
    EXPECT_GT(pose->overlap, 0.96);
    EXPECT_LT(pose->part_from_part.translation().norm(), 0.05) << "[mm]; the axis passes through the origin";
  }
}

TEST(FindSymmetriesOfRealParts, PartsOfTheDevelopmentScenesHaveNone) {
  for (int i = 1; i <= 5; ++i) {
    const fs::path path = data_root() / ("scenes_dev/models/obj_00000" + std::to_string(i) + ".ply");
    TRIBIN_NEEDS(path);
    const auto found = find_symmetries(read_cad(path));
    EXPECT_EQ(found.group.discrete.size(), 1u) << path;
    EXPECT_TRUE(found.group.continuous.empty()) << path;
  }
}

TEST(FindSymmetriesOfRealParts, MachinedBlockHasItsHalfTurn) {
  const fs::path path = data_root() / "real/mp6d/obj_01_mp6d.ply";
  TRIBIN_NEEDS(path);
  const auto found = find_symmetries(read_cad(path));
  EXPECT_EQ(found.group.discrete.size(), 1u);
  const auto* pose = find_turn(found, Vec3::UnitZ(), 180);
  ASSERT_NE(pose, nullptr);
  EXPECT_LT((pose->part_from_part.translation() - Vec3(56, 56, 0)).norm(), 0.1) << "about the middle of the block";
}

TEST(FindSymmetriesOfRealParts, ScrewsSpacersAndBushings) {
  const struct {
    const char* file;
    std::size_t continuous, discrete;
  } parts[] = {
      {"09_EDCS10", 1, 1},                                  // end cap: round, two different ends
      {"10_CLBPS10_17_4", 1, 2},                            // spacer ring: round, like ends
      {"12_CLBUS6-9-9.5", 1, 2},                            // bushing
      {"16_SPWF6", 1, 2},                                   // washer
      {"14_BGPSL6-9-L30-F8", 0, 6},                         // pin with a hexagon
      {"17_SCB4-10", 0, 6},                                 // cap screws: round but for the hexagon socket
      {"18_SCB3-10", 0, 6},         {"19_MSSFS3-6", 0, 6},  // set screw
  };
  for (const auto& part : parts) {
    const fs::path path = data_root() / "cad/o2ac" / (std::string(part.file) + ".stl");
    TRIBIN_NEEDS(path);
    const auto found = find_symmetries(read_cad(path));
    EXPECT_EQ(found.group.continuous.size(), part.continuous) << part.file;
    EXPECT_EQ(found.group.discrete.size(), part.discrete) << part.file;
  }
}

TEST(FindSymmetriesOfRealParts, MovingThePartMovesTheAnswer) {
  const fs::path path = data_root() / "scenes_dev/models/obj_000003.ply";
  TRIBIN_NEEDS(path);
  const Mesh mesh = read_cad(path);
  const auto still = find_symmetries(mesh);
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const Pose pose = test::random_pose(seed);
    const auto found = find_symmetries(test::moved(mesh, pose));
    EXPECT_EQ(found.group.discrete.size(), still.group.discrete.size());
    for (std::size_t i = 0; i < std::min<std::size_t>(3, still.self_similar.size()); ++i) {
      const Matrix3 wanted = pose.linear() * still.self_similar[i].part_from_part.linear() * pose.linear().transpose();
      const auto* match =
          find_turn(found, vector_from_rotation(wanted).normalized(), vector_from_rotation(wanted).norm() / kDegree);
      ASSERT_NE(match, nullptr) << i;
      EXPECT_NEAR(match->overlap, still.self_similar[i].overlap, 0.02);
    }
  }
}

TEST(FindSymmetriesOfRealParts, SameInputSameBytes) {
  const fs::path path = data_root() / "scenes_dev/models/obj_000004.ply";
  TRIBIN_NEEDS(path);
  const Mesh mesh = read_cad(path);
  const auto a = find_symmetries(mesh), b = find_symmetries(mesh);
  ASSERT_EQ(a.self_similar.size(), b.self_similar.size());
  for (std::size_t i = 0; i < a.self_similar.size(); ++i) {
    EXPECT_EQ(a.self_similar[i].part_from_part.matrix(), b.self_similar[i].part_from_part.matrix());
    EXPECT_EQ(a.self_similar[i].overlap, b.self_similar[i].overlap);
    EXPECT_EQ(a.self_similar[i].discriminating_points, b.self_similar[i].discriminating_points);
  }
}

}  // namespace
}  // namespace tribin
