#include <gtest/gtest.h>

#include <cmath>

#include "capture/synthetic_frames.hpp"
#include "support/board_picture.hpp"
#include "support/board_rig.hpp"
#include "tribin/calibration/find_board.hpp"
#include "tribin/capture/projector_points.hpp"
#include "tribin/capture/triangulate.hpp"
#include "tribin/core/error.hpp"
#include "tribin/core/parallel.hpp"

namespace tribin {
namespace {

using test::BoardRig;

/// What the first camera takes of the board under a pattern set.
FrameStack frames_of(const BoardRig& rig, std::size_t view, const std::vector<Pattern>& patterns, unsigned seed) {
  const RigCamera &camera = rig.devices[0], &projector = rig.devices.back();
  const PinholeCamera& c = camera.camera;
  const Pose& pose = rig.rig_from_board[view];
  const Pose board_from_rig = pose.inverse();
  Image<Vec2> lit(c.width, c.height, Vec2::Constant(-100));
  Image<float> albedo(c.width, c.height, 0);
  const double per_px = (pose.translation().norm()) / c.fx;
  for (int v = 0; v < c.height; ++v)
    for (int u = 0; u < c.width; ++u) {
      const Vec3 ray = c.ray(u, v);
      const std::optional<Vec2> ideal = undistorted(camera.distortion, {ray.x(), ray.y()});
      const Vec3 along = board_from_rig.linear() * Vec3(ideal->x(), ideal->y(), 1), from = board_from_rig.translation();
      const Vec3 place = from - from.z() / along.z() * along;
      lit(u, v) = pixel_of(projector, pose * place);
      // Beside its image the projector throws no light.
      if (lit(u, v).minCoeff() < -0.5 || lit(u, v).x() > projector.camera.width - 0.5 ||
          lit(u, v).y() > projector.camera.height - 0.5)
        continue;
      albedo(u, v) = static_cast<float>(
          0.15 + 0.85 * test::board_light(rig.board, {.blur_px = 0.7}, place.x(), place.y(), {per_px, per_px}));
    }
  return test::synthetic_frames(
      patterns, c.width, c.height, {.modulation = 80, .noise = 1.5}, seed,
      [&](int u, int v) { return lit(u, v).x() + 0.5; }, [&](int u, int v) { return lit(u, v).y() + 0.5; },
      [&](int u, int v) { return albedo(u, v); });
}

BoardRig projector_rig(unsigned seed) {
  return test::random_board_rig(seed, {.board = {BoardKind::chessboard, 9, 6, 20},
                                       .cameras = 1,
                                       .projector = true,
                                       .views = 8,
                                       .width = 480,
                                       .height = 360});
}

TEST(ProjectorPoints, HitTheTruthAndCalibrateTheProjector) {
  const std::vector<Pattern> patterns =
      make_patterns({.width = 480, .height = 360, .period_px = 16, .steps = 3, .rows = true});
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const BoardRig rig = projector_rig(seed);
    const std::size_t views = rig.ids.size();
    std::vector<BoardObserver> observers{{"camera", 480, 360, false, std::vector<BoardSighting>(views)},
                                         {"projector", 480, 360, true, std::vector<BoardSighting>(views)}};
    std::vector<Decoded> decoded(views);
    const std::vector<Vec3> points = board_points(rig.board);
    double squares = 0;
    int count = 0;
    for (std::size_t v = 0; v < views; ++v) {
      const FrameStack frames = frames_of(rig, v, patterns, seed);
      decoded[v] = decode(frames);
      const std::optional<BoardSighting> seen = find_board(frames.grey8[0], rig.board);  // the white one
      if (!seen) continue;
      observers[0].views[v] = *seen;
      observers[1].views[v] = projector_points(*seen, decoded[v]);
      const BoardSighting& lit = observers[1].views[v];
      EXPECT_GE(lit.point.size(), points.size() * 9 / 10);
      for (std::size_t i = 0; i < lit.point.size(); ++i) {
        const Vec2 truth =
            pixel_of(rig.devices[1], rig.rig_from_board[v] * points[static_cast<std::size_t>(lit.point[i])]);
        squares += (lit.pixel[i] - truth).squaredNorm(), ++count;
      }
    }
    RecordProperty("projector_points_rms_px_" + std::to_string(seed), std::to_string(std::sqrt(squares / count)));
    EXPECT_LT(std::sqrt(squares / count), 0.1);

    const RigCalibration result = calibrate_rig(rig.board, observers);
    EXPECT_LT(result.rms_px, 0.15);
    for (std::size_t d = 0; d < 2; ++d) {
      const auto want = test::intrinsics_of(rig.devices[d]), got = test::intrinsics_of(result.observers[d].camera);
      for (int i = 0; i < 9; ++i)
        EXPECT_LT(std::abs(got[static_cast<std::size_t>(i)] - want[static_cast<std::size_t>(i)]),
                  4 * std::sqrt(result.observers[d].covariance(i, i)))
            << d << " " << kIntrinsicNames[static_cast<std::size_t>(i)];
    }
    // With this rig the board is measured where it is.
    const Rig found{{result.observers[0].camera}, result.observers[1].camera, "boards"};
    const Triangulated scan = triangulate(found, decoded[0]);
    EXPECT_TRUE(scan.scan.warnings.empty());
    std::vector<double> off;
    const Pose board_from_rig = rig.rig_from_board[0].inverse();
    for (int v = 60; v < 300; v += 3)
      for (int u = 80; u < 400; u += 3)
        if (std::isfinite(scan.scan.z_mm(u, v)))
          off.push_back(std::abs((board_from_rig * (scan.rig_from_scan * scan.scan.point(u, v))).z()));
    ASSERT_GT(off.size(), 5000u);
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
    const double median = off[off.size() / 2];
    RecordProperty("plane_median_mm_" + std::to_string(seed), std::to_string(median));
    EXPECT_LT(median, 1.5 * scan.scan.noise.sigma_mm);  // 0.67 of noise alone
  }
}

TEST(ProjectorPoints, WantsColumnsAndRows) {
  Decoded decoded;
  decoded.column = Image<float>(10, 10, 1);
  try {
    projector_points({}, decoded);
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(),
                 "frames of a board: saw patterns along columns alone, wanted both (tribin patterns --axes both)");
  }
}

}  // namespace
}  // namespace tribin
