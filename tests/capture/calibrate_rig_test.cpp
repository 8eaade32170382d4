#include "tribin/capture/calibrate_rig.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "support/board_rig.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using test::BoardRig;
using test::BoardRigOptions;

/// Deviations from the truth in their own sd: all intrinsics and poses of all observers.
struct Deviations {
  double worst = 0, squares = 0;
  int count = 0;
  void add(double error, double sd) {
    worst = std::max(worst, std::abs(error / sd));
    squares += error * error / (sd * sd), ++count;
  }
};

void compare(const BoardRig& truth, const RigCalibration& result, Deviations& out) {
  for (std::size_t d = 0; d < truth.devices.size(); ++d) {
    const auto want = test::intrinsics_of(truth.devices[d]), got = test::intrinsics_of(result.observers[d].camera);
    for (int i = 0; i < 9; ++i)
      out.add(got[static_cast<std::size_t>(i)] - want[static_cast<std::size_t>(i)],
              std::sqrt(result.observers[d].covariance(i, i)));
    if (d == 0) continue;
    const Pose &a = truth.devices[d].rig_from_camera, &b = result.observers[d].camera.rig_from_camera;
    const Vec3 t = a.translation() - b.translation(),
               w = vector_from_rotation(Matrix3(a.linear() * b.linear().transpose()));
    for (int i = 0; i < 6; ++i) out.add(i < 3 ? t[i] : w[i - 3], std::sqrt(result.observers[d].pose_covariance(i, i)));
  }
}

TEST(CalibrateRig, FindsAnyRigWithinItsCovariance) {
  Deviations all;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    const BoardRig rig = test::random_board_rig(
        seed,
        {.cameras = 1 + static_cast<int>(seed % 3), .projector = seed % 4 == 0, .focal = seed % 5 == 0 ? 2.5 : 1.2});
    const RigCalibration result = calibrate_rig(rig.board, test::observed(rig, 0.1, seed));
    Deviations own;
    compare(rig, result, own);
    EXPECT_LT(own.worst, 4.5);  // of some 5000 numbers: the Gaussian's worst is near 4
    all.squares += own.squares, all.count += own.count;
    for (const ObserverCalibration& o : result.observers) {
      EXPECT_NEAR(o.sigma_px, 0.1, 0.02);
      EXPECT_TRUE(o.held[0] && o.held[2]);
    }
    for (const BoardView& v : result.views) EXPECT_TRUE(v.used);
  }
  RecordProperty("mean_square", std::to_string(all.squares / all.count));
  // Mean square in sigmas: 1, a little less because of the priors.
  EXPECT_NEAR(all.squares / all.count, 0.95, 0.15) << all.count;
}

TEST(CalibrateRig, AddsAProjectorToCamerasThatAreKnown) {
  Deviations all;
  for (unsigned seed = 1; seed <= 15; ++seed) {
    SCOPED_TRACE(seed);
    BoardRig rig =
        test::random_board_rig(seed, {.cameras = 1 + static_cast<int>(seed % 2), .projector = true, .views = 8});
    // The rig's frame lies elsewhere than in its first camera.
    const Pose rig_from_first = test::pose_at(Vec3(0.1, 0.2, -0.3), Vec3(100, -50, 20));
    for (RigCamera& device : rig.devices) device.rig_from_camera = rig_from_first * device.rig_from_camera;
    for (Pose& pose : rig.rig_from_board) pose = rig_from_first * pose;
    std::vector<BoardObserver> seen = test::observed(rig, 0.1, seed);
    for (std::size_t d = 0; d + 1 < seen.size(); ++d) seen[d].known = rig.devices[d];
    const RigCalibration result = calibrate_rig(rig.board, seen);
    for (std::size_t d = 0; d + 1 < seen.size(); ++d) {
      EXPECT_EQ(test::intrinsics_of(result.observers[d].camera), test::intrinsics_of(rig.devices[d]));
      EXPECT_EQ(result.observers[d].camera.rig_from_camera.matrix(), rig.devices[d].rig_from_camera.matrix());
      EXPECT_EQ(result.observers[d].covariance(0, 0), 0);
      EXPECT_NEAR(result.observers[d].sigma_px, 0.1, 0.02);
    }
    const ObserverCalibration& got = result.observers.back();
    const auto want = test::intrinsics_of(rig.devices.back()), numbers = test::intrinsics_of(got.camera);
    Deviations own;
    for (int i = 0; i < 9; ++i)
      own.add(numbers[static_cast<std::size_t>(i)] - want[static_cast<std::size_t>(i)],
              std::sqrt(got.covariance(i, i)));
    const Pose& pose = rig.devices.back().rig_from_camera;
    const Vec3 t = pose.translation() - got.camera.rig_from_camera.translation();
    for (int i = 0; i < 3; ++i) own.add(t[i], std::sqrt(got.pose_covariance(i, i)));
    EXPECT_LT(own.worst, 4.5);
    all.squares += own.squares, all.count += own.count;
  }
  EXPECT_NEAR(all.squares / all.count, 0.95, 0.35) << all.count;
}

TEST(CalibrateRig, CirclesSeenAslantAreMeasuredAtTheirCentres) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    const Board board{BoardKind::asymmetric_circles, 4, 11, 40};
    const BoardRig rig = test::random_board_rig(seed, {.board = board, .cameras = 1, .views = 12, .focal = 1.0});
    std::vector<BoardObserver> exact = test::observed(rig, 0, seed), blobs = exact;
    const std::vector<Vec3> points = board_points(board);
    const double radius = 0.25 * board.pitch_mm;  // half of the diagonal neighbours' distance is white
    double most = 0;
    for (std::size_t v = 0; v < rig.rig_from_board.size(); ++v) {
      BoardSighting& seen = blobs[0].views[v];
      for (std::size_t i = 0; i < seen.point.size(); ++i) {
        // The blob's area and centroid from its outline: Green's theorem on 720 points.
        double area = 0;
        Vec2 moment = Vec2::Zero(), before = Vec2::Zero();
        const Vec3 centre = points[static_cast<std::size_t>(seen.point[i])];
        for (int k = 0; k <= 720; ++k) {
          const double a = k * kPi / 360;
          const Vec2 now =
              pixel_of(rig.devices[0], rig.rig_from_board[v] * (centre + radius * Vec3(std::cos(a), std::sin(a), 0))) -
              seen.pixel[i];
          const double cross = before.x() * now.y() - before.y() * now.x();
          if (k > 0) area += cross / 2, moment += cross / 6 * (before + now);
          before = now;
        }
        most = std::max(most, (moment / area).norm());
        seen.pixel[i] += moment / area;
        seen.area_px.push_back(std::abs(area));
      }
    }
    const RigCalibration corrected = calibrate_rig(board, blobs);
    for (BoardSighting& seen : blobs[0].views) seen.area_px.clear();
    const RigCalibration biased = calibrate_rig(board, blobs);
    const double focal = rig.devices[0].camera.fx;
    EXPECT_GT(most, 0.05);
    EXPECT_LT(corrected.rms_px, 0.05 * biased.rms_px);
    EXPECT_LT(std::abs(corrected.observers[0].camera.camera.fx - focal), 1e-4 * focal);
    EXPECT_LT(std::abs(corrected.observers[0].camera.camera.fx - focal),
              0.2 * std::abs(biased.observers[0].camera.camera.fx - focal) + 0.01);
  }
}

TEST(CalibrateRig, LeavesOutAndNamesWrongViews) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const BoardRig rig = test::random_board_rig(seed, {.views = 16});
    std::vector<BoardObserver> seen = test::observed(rig, 0.1, seed);
    // The board moved between the pictures of one view; one view's points are a wild guess; one point is elsewhere.
    for (Vec2& p : seen[1].views[3].pixel) p += Vec2(12, -7);
    sim::Random random(seed);
    for (Vec2& p : seen[0].views[8].pixel) p += Vec2(8 * random.normal(), 8 * random.normal());
    seen[0].views[5].pixel[7] += Vec2(0, 4);
    const RigCalibration result = calibrate_rig(rig.board, seen);
    for (std::size_t v = 0; v < result.views.size(); ++v) EXPECT_EQ(result.views[v].used, v != 3 && v != 8) << v;
    EXPECT_EQ(result.observers[0].dropped_points, 1);
    Deviations own;
    compare(rig, result, own);
    EXPECT_LT(own.worst, 4.5);
  }
}

TEST(CalibrateRig, TurnsBoardsThatLookAlike) {
  const Board boards[] = {
      {BoardKind::chessboard, 7, 5, 20}, {BoardKind::circles, 6, 6, 20}, {BoardKind::asymmetric_circles, 4, 10, 30}};
  for (unsigned seed = 1; seed <= 9; ++seed) {
    SCOPED_TRACE(seed);
    const BoardRig rig = test::random_board_rig(seed, {.board = boards[seed % 3], .cameras = 3});
    std::vector<BoardObserver> seen = test::observed(rig, 0.1, seed);
    const std::vector<int> turns = look_alike_turns(rig.board);
    ASSERT_GT(turns.size(), 1u);
    sim::Random random(seed);
    for (BoardObserver& o : seen)
      for (BoardSighting& s : o.views) {
        const int turn = turns[static_cast<std::size_t>(random.integer(0, static_cast<int>(turns.size()) - 1))];
        for (int& point : s.point) point = turned_point(rig.board, point, turn);
      }
    const RigCalibration result = calibrate_rig(rig.board, seen);
    Deviations own;
    compare(rig, result, own);
    EXPECT_LT(own.worst, 4.5);
    for (const BoardView& v : result.views) EXPECT_TRUE(v.used);
  }
}

TEST(CalibrateRig, TurningFourTimesIsNothing) {
  const Board board{BoardKind::circles, 5, 5, 10};
  for (int i = 0; i < 25; ++i) {
    EXPECT_EQ(turned_point(board, turned_point(board, i, 1), 3), i);
    EXPECT_EQ(turned_point(board, turned_point(board, i, 1), 1), turned_point(board, i, 2));
    EXPECT_EQ(turned_point(board, turned_point(board, i, 3), -3), i);
  }
}

TEST(CalibrateRig, SaysWhatIsMissing) {
  const auto message_of = [](const BoardRig& rig, const std::vector<BoardObserver>& seen) -> std::string {
    try {
      calibrate_rig(rig.board, seen);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::too_little_data);
      return e.what();
    }
    return "";
  };
  const BoardRig rig = test::random_board_rig(1, {.views = 8});
  const std::vector<BoardObserver> all = test::observed(rig, 0.1, 1);

  std::vector<BoardObserver> few = all;
  for (std::size_t v = 2; v < 8; ++v) few[1].views[v] = {};
  EXPECT_EQ(message_of(rig, few), "camera right: saw 2 views of the board, wanted 3 at least; 10 to 20 are good");

  std::vector<BoardObserver> apart = all;
  for (std::size_t v = 0; v < 8; ++v) apart[v < 4].views[v] = {};
  EXPECT_NE(message_of(rig, apart).find("camera right: saw no view of the board that camera left has too"),
            std::string::npos);

  const BoardRig flat = test::random_board_rig(1, {.cameras = 1, .tilt = 0.3 * kDegree});
  EXPECT_NE(message_of(flat, test::observed(flat, 0.1, 1)).find("leave its focal length open"), std::string::npos);
}

TEST(CalibrateRig, KnowsWhatTheViewsDoNotCover) {
  BoardRig rig = test::random_board_rig(3, {.cameras = 1, .views = 20});
  std::vector<BoardObserver> seen = test::observed(rig, 0.1, 3);
  const ObserverCalibration whole = calibrate_rig(rig.board, seen).observers[0];
  for (double sd : whole.ray_sd_px) EXPECT_LT(sd, 0.5);
  for (BoardSighting& s : seen[0].views) {  // nothing right of the middle
    BoardSighting left;
    for (std::size_t i = 0; i < s.point.size(); ++i)
      if (s.pixel[i].x() < 640) left.point.push_back(s.point[i]), left.pixel.push_back(s.pixel[i]);
    s = left.point.size() < 12 ? BoardSighting{} : left;
  }
  const ObserverCalibration o = calibrate_rig(rig.board, seen).observers[0];
  EXPECT_EQ(o.coverage.points[2] + o.coverage.points[5] + o.coverage.points[8], 0);
  EXPECT_GT(o.coverage.points[3], 0);
  EXPECT_GT(o.ray_sd_px[5], 3 * whole.ray_sd_px[5]);
  EXPECT_LT(o.coverage.tilt_x_least, -10 * kDegree);
  EXPECT_GT(o.coverage.tilt_y_most, 10 * kDegree);
}

}  // namespace
}  // namespace tribin
