#include "tribin/calibration/find_board.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/as_mat.hpp"
#include "calibration/find_charuco.hpp"
#include "tribin/core/error.hpp"

namespace tribin {
namespace {

using calibration_detail::as_mat;
using calibration_detail::vec;

/// Points in the order of the grid; turned or mirrored orders of the same grid are mended by `mend_order`.
BoardSighting whole_board(const std::vector<cv::Point2f>& points) {
  BoardSighting out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.point.push_back(static_cast<int>(i));
    out.pixel.push_back(vec(points[i]));
  }
  return out;
}

/// The rows must run to the right of the columns, as on the board seen from the front.
void unmirror(BoardSighting& seen, const Board& board) {
  const auto at = [&](int c, int r) { return seen.pixel[static_cast<std::size_t>(r * board.columns + c)]; };
  const Vec2 x = at(board.columns - 1, 0) - at(0, 0), y = at(0, board.rows - 1) - at(0, 0);
  if (x.x() * y.y() - x.y() * y.x() > 0) return;
  for (int r = 0; r < board.rows; ++r)
    std::reverse(seen.pixel.begin() + r * board.columns, seen.pixel.begin() + (r + 1) * board.columns);
}

double mean_grey(const Image<std::uint8_t>& picture, const Vec2& at, double radius) {
  double sum = 0;
  int count = 0;
  for (int v = static_cast<int>(std::ceil(at.y() - radius)); v <= at.y() + radius; ++v)
    for (int u = static_cast<int>(std::ceil(at.x() - radius)); u <= at.x() + radius; ++u)
      if (picture.contains(u, v)) sum += picture(u, v), ++count;
  return count > 0 ? sum / count : 0;
}

/// Turns the numbers so that the square behind the first corner is dark, where a turn can do that.
void start_at_dark(BoardSighting& seen, const Board& board, const Image<std::uint8_t>& picture) {
  const auto at = [&](int c, int r) { return seen.pixel[static_cast<std::size_t>(r * board.columns + c)]; };
  double difference = 0;  // dark squares minus light ones, were the first one dark
  for (int r = 0; r + 1 < board.rows; ++r)
    for (int c = 0; c + 1 < board.columns; ++c) {
      const Vec2 middle = 0.25 * (at(c, r) + at(c + 1, r) + at(c, r + 1) + at(c + 1, r + 1));
      const double radius = 0.2 * std::min((at(c + 1, r) - at(c, r)).norm(), (at(c, r + 1) - at(c, r)).norm());
      difference += ((c + r) % 2 == 0 ? 1 : -1) * mean_grey(picture, middle, std::max(radius, 1.0));
    }
  if (difference < 0) return;
  const bool half = (board.columns + board.rows) % 2 == 1;
  if (!half && !(board.columns == board.rows && board.columns % 2 == 1)) return;
  BoardSighting turned = seen;
  for (std::size_t i = 0; i < seen.pixel.size(); ++i)
    turned.pixel[static_cast<std::size_t>(turned_point(board, static_cast<int>(i), half ? 2 : 1))] = seen.pixel[i];
  seen = turned;
}

std::optional<BoardSighting> find_chessboard(const Image<std::uint8_t>& picture, const Board& board) {
  const cv::Size size(board.columns, board.rows);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCornersSB(as_mat(picture), size, corners, cv::CALIB_CB_NORMALIZE_IMAGE) &&
      !cv::findChessboardCornersSB(as_mat(picture), size, corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE))
    return std::nullopt;
  double nearest = 1e9;
  for (std::size_t i = 0; i < corners.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) nearest = std::min(nearest, cv::norm(corners[i] - corners[j]));
  // A third of a square: as much edge as there is without meeting the next corner's. Noise, blooming and blur fall with
  // the window: on real pictures with squares of 45 px, 0.76 px at a half width of 3, 0.33 at 7, 0.22 at 14.
  const int half = std::clamp(static_cast<int>(nearest / 3), 2, 30);
  cv::cornerSubPix(as_mat(picture), corners, {half, half}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::MAX_ITER, 100, 0.0005});
  BoardSighting out = whole_board(corners);
  unmirror(out, board);
  start_at_dark(out, board, picture);
  return out;
}

struct Blob {
  Vec2 centre;
  double area = 0;  ///< [px]
};

/// Centroid and area of a blob's grey levels against its surroundings; its half axis is about a quarter of `pitch_px`.
Blob blob_at(const Image<std::uint8_t>& picture, const Vec2& start, double pitch_px, bool light) {
  const double reach = 0.5 * pitch_px;
  // Between the two grey levels of the window: a tenth of the way off both, noise and shading count for nothing.
  std::vector<std::uint8_t> values;
  const auto each = [&](auto&& visit) {
    for (int v = static_cast<int>(std::ceil(start.y() - reach)); v <= start.y() + reach; ++v)
      for (int u = static_cast<int>(std::ceil(start.x() - reach)); u <= start.x() + reach; ++u)
        if (picture.contains(u, v) && (Vec2(u, v) - start).squaredNorm() <= reach * reach) visit(u, v);
  };
  each([&](int u, int v) { values.push_back(picture(u, v)); });
  if (values.size() < 9) return {start};
  std::sort(values.begin(), values.end());
  const double low = values[values.size() / 20], high = values[values.size() - 1 - values.size() / 20];
  const double floor = low + 0.1 * (high - low), roof = high - 0.1 * (high - low);
  if (!(roof > floor)) return {start};
  Vec2 sum = Vec2::Zero();
  double weight = 0;
  each([&](int u, int v) {
    double w = std::clamp((picture(u, v) - floor) / (roof - floor), 0.0, 1.0);
    if (!light) w = 1 - w;
    sum += w * Vec2(u, v);
    weight += w;
  });
  return weight > 0 ? Blob{sum / weight, weight} : Blob{start};
}

std::optional<BoardSighting> find_circles(const Image<std::uint8_t>& picture, const Board& board) {
  const bool asymmetric = board.kind == BoardKind::asymmetric_circles;
  for (const bool light : {false, true}) {
    cv::SimpleBlobDetector::Params blobs;
    blobs.blobColor = light ? 255 : 0;
    // From 5 px across to as large as the board's circles can be in the picture.
    blobs.minArea = 20;
    blobs.maxArea = static_cast<float>(static_cast<double>(picture.size()) / (board.columns * board.rows));
    blobs.minDistBetweenBlobs = 5;
    std::vector<cv::Point2f> centres;
    if (!cv::findCirclesGrid(as_mat(picture), {board.columns, board.rows}, centres,
                             asymmetric ? cv::CALIB_CB_ASYMMETRIC_GRID : cv::CALIB_CB_SYMMETRIC_GRID,
                             cv::SimpleBlobDetector::create(blobs)))
      continue;
    BoardSighting out = whole_board(centres);
    if (!asymmetric) unmirror(out, board);
    const std::vector<Vec2> rough = out.pixel;
    for (std::size_t i = 0; i < rough.size(); ++i) {
      double nearest = 1e9;
      for (std::size_t j = 0; j < rough.size(); ++j)
        if (j != i) nearest = std::min(nearest, (rough[j] - rough[i]).norm());
      const Blob blob = blob_at(picture, rough[i], nearest, light);
      out.pixel[i] = blob.centre;
      out.area_px.push_back(blob.area);
    }
    return out;
  }
  return std::nullopt;
}

}  // namespace

std::optional<BoardSighting> find_board(const Image<std::uint8_t>& picture, const Board& board) {
  validate(board);
  // OpenCV's filters want some pixels to work on.
  if (picture.width < 32 || picture.height < 32) return std::nullopt;
  cv::setNumThreads(1);  // threads are the caller's, who has more than one picture
  try {
    switch (board.kind) {
      case BoardKind::chessboard:
        return find_chessboard(picture, board);
      case BoardKind::charuco:
        return calibration_detail::find_charuco(picture, board);
      default:
        return find_circles(picture, board);
    }
  } catch (const cv::Exception& e) {
    throw Error(ErrorCode::internal, "OpenCV: " + std::string(e.what()));
  }
}

std::optional<std::pair<int, int>> chessboard_size(const Image<std::uint8_t>& picture) {
  if (picture.width < 32 || picture.height < 32) return std::nullopt;
  cv::Mat corners, meta;
  try {
    if (!cv::findChessboardCornersSB(as_mat(picture), {3, 3}, corners,
                                     cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_LARGER,
                                     meta))
      return std::nullopt;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  return std::pair{std::max(meta.cols, meta.rows), std::min(meta.cols, meta.rows)};
}

}  // namespace tribin
