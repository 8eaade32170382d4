#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/shared_data.hpp"
#include "tribin/calibration/find_board.hpp"
#include "tribin/capture/calibrate_rig.hpp"
#include "tribin/capture/triangulate.hpp"
#include "tribin/core/parallel.hpp"
#include "tribin/io/frames_file.hpp"
#include "tribin/segmentation/primitives.hpp"

namespace tribin {
namespace {

/// The rig of the recording, from its own pictures of a board.
RigCalibration calibrated(const std::filesystem::path& folder) {
  const Board board{BoardKind::chessboard, 7, 6, 20};  // 20 mm by its author, who is not sure
  std::vector<std::string> ids;
  for (int i = 1; i <= 16; ++i) ids.push_back((i < 10 ? "0" : "") + std::to_string(i));
  std::vector<BoardObserver> observers{{"left", 1292, 964, false, std::vector<BoardSighting>(16)},
                                       {"right", 1292, 964, false, std::vector<BoardSighting>(16)}};
  parallel_each(32, [&](int k) {
    const auto i = static_cast<std::size_t>(k % 16);
    const auto picture = read_picture(folder / "calib" / (k < 16 ? "L" : "R") / (ids[i] + ".png"));
    observers[static_cast<std::size_t>(k / 16)].views[i] = find_board(picture, board).value_or(BoardSighting{});
  });
  return calibrate_rig(board, observers);
}

TEST(RealBoards, ConeAndCylinderByACalibrationOfTheirOwn) {
  const std::filesystem::path folder = test::shared_data("real/cone_cylinder_stereo");
  TRIBIN_NEED_DATA(folder);
  const RigCalibration result = calibrated(folder);
  RecordProperty("rms_px", std::to_string(result.rms_px));
  EXPECT_LE(result.rms_px, 0.28);
  int used = 0;
  for (const BoardView& v : result.views) used += v.used;
  EXPECT_GE(used, 15);
  for (const ObserverCalibration& o : result.observers) EXPECT_LE(o.rms_px, 0.28);

  const std::filesystem::path list =
      std::filesystem::path(TRIBIN_SOURCE_DIR) / "examples/rigs/cone_cylinder_stereo/frames.json";
  const std::vector<FrameStack> frames = read_frames(folder, list);
  const Rig rig{{result.observers[0].camera, result.observers[1].camera}, std::nullopt, "boards"};
  const Triangulated scan = triangulate(rig, decode(frames[0]), decode(frames[1]));
  EXPECT_GE(valid_count(scan.scan), 115000u);
  EXPECT_TRUE(scan.scan.warnings.empty());

  // The cylinder goes through the cone, so that it shows on both sides; its pieces must be one cylinder: equal radii,
  // one axis. Nobody measured the solid: the limits are the recording's own errors (3-step fringes with saturated
  // pixels beside them bend the surface by 0.2 mm).
  const Primitives found = segment(surfels_from_scan(scan.scan));
  const Primitive* cone = nullptr;
  std::vector<const Primitive*> cylinders;
  for (const Primitive& p : found.items) {
    if (p.type == PrimitiveType::cone && !cone && p.points >= 5000) cone = &p;
    if (p.type == PrimitiveType::cylinder && p.points >= 5000 && std::abs(p.radius_mm - 37.2) < 1.5)
      cylinders.push_back(&p);
  }
  ASSERT_TRUE(cone);
  EXPECT_NEAR(cone->half_angle / kDegree, 15, 3);
  ASSERT_EQ(cylinders.size(), 2u);
  const Primitive &a = *cylinders[0], &b = *cylinders[1];
  EXPECT_NEAR(a.radius_mm, b.radius_mm, 0.6);
  EXPECT_GT(std::abs(a.axis.dot(b.axis)), std::cos(1.5 * kDegree));
  EXPECT_LT((b.point - a.point).cross(a.axis).norm(), 2.5);
  EXPECT_LT(std::abs(cone->axis.dot(a.axis)), std::sin(5 * kDegree));
}

}  // namespace
}  // namespace tribin
