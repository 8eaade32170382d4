#include "tribin/calibration/find_board.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>

#ifdef TRIBIN_HAS_ARUCO
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>
#endif

#include "support/board_picture.hpp"
#include "support/board_rig.hpp"
#include "support/temporary_folder.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using test::BoardRig;
using test::PictureOptions;

/// The picture of one view, and where the truth is.
struct Shot {
  Image<std::uint8_t> picture;
  std::vector<Vec2> truth;  ///< of each point of the board
};

Shot shot_of(const BoardRig& rig, std::size_t view, const PictureOptions& options, unsigned seed) {
  Shot out{test::board_picture(rig.board, rig.devices[0], rig.rig_from_board[view], options, seed), {}};
  for (const Vec3& p : board_points(rig.board))
    out.truth.push_back(pixel_of(rig.devices[0], rig.rig_from_board[view] * p));
  return out;
}

/// rms distance from the truth [px], for the turn of the numbers that fits best.
double error_of(const Board& board, const BoardSighting& seen, const std::vector<Vec2>& truth) {
  double least = 1e9;
  for (const int turn : look_alike_turns(board)) {
    double sum = 0;
    for (std::size_t i = 0; i < seen.point.size(); ++i)
      sum += (seen.pixel[i] - truth[static_cast<std::size_t>(turned_point(board, seen.point[i], turn))]).squaredNorm();
    least = std::min(least, std::sqrt(sum / static_cast<double>(seen.point.size())));
  }
  return least;
}

test::BoardRigOptions one_camera(const Board& board) {
  return {.board = board, .cameras = 1, .views = 4, .width = 800, .height = 600};
}

TEST(FindBoard, ChessboardsToAPartOfAPixel) {
  for (const Board& board : {Board{BoardKind::chessboard, 9, 6, 20},
                             {BoardKind::chessboard, 6, 9, 20},
                             {BoardKind::chessboard, 7, 7, 20},
                             {BoardKind::chessboard, 6, 4, 30}})
    for (unsigned seed = 1; seed <= 2; ++seed) {
      SCOPED_TRACE(describe(board) + ", seed " + std::to_string(seed));
      const BoardRig rig = test::random_board_rig(seed, one_camera(board));
      for (std::size_t v = 0; v < 3; ++v) {
        const Shot shot = shot_of(rig, v, {}, seed);
        const std::optional<BoardSighting> seen = find_board(shot.picture, board);
        ASSERT_TRUE(seen);
        ASSERT_EQ(seen->point.size(), shot.truth.size());
        EXPECT_LT(error_of(board, *seen, shot.truth), 0.06);
      }
    }
}

TEST(FindBoard, CirclesOfBothGridsAndBothColours) {
  for (const Board& board : {Board{BoardKind::circles, 7, 6, 20}, {BoardKind::asymmetric_circles, 4, 11, 30}})
    for (const bool inverted : {false, true}) {
      SCOPED_TRACE(describe(board) + (inverted ? ", light" : ", dark"));
      const BoardRig rig = test::random_board_rig(5, one_camera(board));
      PictureOptions options;
      if (inverted) std::swap(options.dark, options.light);
      for (std::size_t v = 0; v < 3; ++v) {
        const Shot shot = shot_of(rig, v, options, 5);
        const std::optional<BoardSighting> seen = find_board(shot.picture, board);
        ASSERT_TRUE(seen) << v;
        // An ellipse's middle is not quite the circle's.
        EXPECT_LT(error_of(board, *seen, shot.truth), 0.12) << v;
      }
    }
}

#ifdef TRIBIN_HAS_ARUCO
/// The printed board, as OpenCV draws it; the other layout is the same board with an added row, cut off.
Image<std::uint8_t> printed(const Board& board, int px_a_square, bool old_layout) {
  const int rows = board.rows + (old_layout ? 0 : board.rows % 2 == 0 ? 1 : 0);
  const auto drawn = cv::aruco::CharucoBoard::create(board.columns, rows, static_cast<float>(board.pitch_mm),
                                                     static_cast<float>(board.marker_mm),
                                                     cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100));
  cv::Mat picture;
  drawn->draw({board.columns * px_a_square, rows * px_a_square}, picture, 0, 1);
  cv::GaussianBlur(picture, picture, {}, 1.5);  // the lens': about a pixel of the camera
  Image<std::uint8_t> out(picture.cols, board.rows * px_a_square);
  for (int v = 0; v < out.height; ++v) std::copy_n(picture.ptr<std::uint8_t>(v), out.width, out.row(v));
  return out;
}

TEST(FindBoard, CharucoInPartAndInBothLayouts) {
  for (const bool old_layout : {true, false})
    for (const int rows : {6, 7}) {
      Board board{BoardKind::charuco, 8, rows, 24, 17, "5X5_100"};
      SCOPED_TRACE(describe(board) + (old_layout ? " old" : " new"));
      const BoardRig rig = test::random_board_rig(7, one_camera(board));
      PictureOptions options;
      options.markers = printed(board, 60, old_layout);
      options.marker_scale = 60 / board.pitch_mm;
      for (std::size_t v = 0; v < 2; ++v) {
        Shot shot = shot_of(rig, v, options, 7);
        std::optional<BoardSighting> seen = find_board(shot.picture, board);
        ASSERT_TRUE(seen);
        EXPECT_GT(seen->point.size(), shot.truth.size() * 8 / 10);
        EXPECT_LT(error_of(board, *seen, shot.truth), 0.15);
        // A hand before the left third of the picture.
        for (int row = 0; row < shot.picture.height; ++row)
          std::fill_n(shot.picture.row(row), static_cast<int>(shot.truth[2].x()), std::uint8_t{90});
        const std::size_t whole = seen->point.size();
        seen = find_board(shot.picture, board);
        ASSERT_TRUE(seen);
        EXPECT_LT(seen->point.size(), whole);
        EXPECT_LT(error_of(board, *seen, shot.truth), 0.15);
      }
    }
  EXPECT_THROW(find_board(Image<std::uint8_t>(100, 100), {BoardKind::charuco, 8, 6, 24, 17, "9X9_1"}), Error);
  EXPECT_THROW(find_board(Image<std::uint8_t>(100, 100), {BoardKind::charuco, 12, 12, 24, 17, "4X4_50"}), Error);
}
#endif

TEST(FindBoard, NothingWhereThereIsNone) {
  const Board board{BoardKind::chessboard, 9, 6, 20};
  const BoardRig rig = test::random_board_rig(2, one_camera(board));
  Shot shot = shot_of(rig, 0, {}, 2);
  EXPECT_FALSE(find_board(shot.picture, {BoardKind::chessboard, 8, 6, 20}));
  EXPECT_FALSE(find_board(shot.picture, {BoardKind::circles, 9, 6, 20}));
  EXPECT_EQ(chessboard_size(shot.picture), (std::pair{9, 6}));
  // Part of a chessboard has no known place on the board.
  for (int v = 0; v < shot.picture.height; ++v)
    std::fill_n(shot.picture.row(v), static_cast<int>(shot.truth[10].x()), std::uint8_t{90});
  EXPECT_FALSE(find_board(shot.picture, board));
  EXPECT_FALSE(find_board(Image<std::uint8_t>(640, 480, 128), board));
  EXPECT_FALSE(find_board(Image<std::uint8_t>(8, 8, 128), board));
}

TEST(ReadPicture, SixteenBitsColoursAndRefusals) {
  const test::TemporaryFolder folder;
  const BoardRig rig = test::random_board_rig(2, one_camera({BoardKind::chessboard, 9, 6, 20}));
  const Shot shot = shot_of(rig, 0, {}, 2);
  const auto write = [&](const std::string& name, auto&& pixel, int type) {
    cv::Mat out(shot.picture.height, shot.picture.width, type);
    for (int v = 0; v < out.rows; ++v)
      for (int u = 0; u < out.cols; ++u) pixel(out, u, v);
    cv::imwrite((folder.path() / name).string(), out);
    return folder.path() / name;
  };
  const auto twelve = write(
      "twelve.png",
      [&](cv::Mat& m, int u, int v) { m.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(4 * shot.picture(u, v)); },
      CV_16UC1);
  const auto colour = write(
      "colour.bmp", [&](cv::Mat& m, int u, int v) { m.at<cv::Vec3b>(v, u) = cv::Vec3b::all(shot.picture(u, v)); },
      CV_8UC3);
  for (const auto& path : {twelve, colour}) {
    const auto seen = find_board(read_picture(path), rig.board);
    ASSERT_TRUE(seen) << path;
    EXPECT_LT(error_of(rig.board, *seen, shot.truth), 0.06);
  }
  for (const std::string& bytes : {std::string("no picture"), std::string("\x89PNG\r\n\x1a\n broken")}) {
    try {
      read_picture(folder.write("bad.png", bytes));
      FAIL();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(e.what()).find("bad.png: whole file: saw"), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW(read_picture(folder.path() / "none.png"), Error);
}

/// What a rig of two cameras makes of the pictures of a board.
RigCalibration calibrated(const BoardRig& rig, const PictureOptions& options, unsigned seed) {
  std::vector<BoardObserver> observers;
  for (const RigCamera& device : rig.devices) {
    BoardObserver o{device.name, device.camera.width, device.camera.height, false, {}};
    for (const Pose& pose : rig.rig_from_board)
      o.views.push_back(
          find_board(test::board_picture(rig.board, device, pose, options, seed), rig.board).value_or(BoardSighting{}));
    observers.push_back(std::move(o));
  }
  return calibrate_rig(rig.board, observers);
}

/// Pictures to parameters: the covariance holds with points as they are found, not only with drawn noise.
TEST(FindBoard, CalibrationFromPicturesFindsTheTruth) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    const BoardRig rig = test::random_board_rig(seed, {.views = 9, .focal = 1.2, .width = 640, .height = 480});
    const RigCalibration result = calibrated(rig, {}, seed + 100);
    EXPECT_LT(result.rms_px, 0.1);
    for (std::size_t d = 0; d < 2; ++d) {
      const ObserverCalibration& o = result.observers[d];
      const auto want = test::intrinsics_of(rig.devices[d]), got = test::intrinsics_of(o.camera);
      for (int i = 0; i < 9; ++i)
        EXPECT_LT(std::abs(got[static_cast<std::size_t>(i)] - want[static_cast<std::size_t>(i)]),
                  3.5 * std::sqrt(o.covariance(i, i)))
            << d << " " << kIntrinsicNames[static_cast<std::size_t>(i)];
      const Vec3 off = o.camera.rig_from_camera.translation() - rig.devices[d].rig_from_camera.translation();
      for (int i = 0; i < 3; ++i) EXPECT_LE(std::abs(off[i]), 3.5 * std::sqrt(o.pose_covariance(i, i)));
    }
  }
}

/// Boards of all kinds give the rig: focal lengths and the distance of the cameras to some thousandths.
TEST(FindBoard, EveryKindOfBoardCalibrates) {
  std::vector<Board> boards{{BoardKind::circles, 8, 6, 20}, {BoardKind::asymmetric_circles, 4, 11, 36}};
#ifdef TRIBIN_HAS_ARUCO
  boards.push_back({BoardKind::charuco, 8, 6, 24, 17, "5X5_100"});
#endif
  for (const Board& board : boards) {
    SCOPED_TRACE(describe(board));
    const BoardRig rig =
        test::random_board_rig(11, {.board = board, .views = 10, .focal = 1.2, .width = 800, .height = 600});
    PictureOptions options;
#ifdef TRIBIN_HAS_ARUCO
    if (board.kind == BoardKind::charuco)
      options.markers = printed(board, 60, true), options.marker_scale = 60 / board.pitch_mm;
#endif
    const RigCalibration result = calibrated(rig, options, 11);
    EXPECT_LT(result.rms_px, 0.15);
    RecordProperty("rms_px_" + std::to_string(static_cast<int>(board.kind)), std::to_string(result.rms_px));
    int used = 0;
    for (const BoardView& v : result.views) used += v.used;
    EXPECT_GE(used, 7);
    for (std::size_t d = 0; d < 2; ++d)
      EXPECT_NEAR(result.observers[d].camera.camera.fx / rig.devices[d].camera.fx, 1, 0.004);
    EXPECT_NEAR(result.observers[1].camera.rig_from_camera.translation().norm() /
                    rig.devices[1].rig_from_camera.translation().norm(),
                1, 0.004);
  }
}

}  // namespace
}  // namespace tribin
