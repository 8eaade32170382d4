#include "calibration/find_charuco.hpp"

#include "tribin/core/error.hpp"

#ifdef TRIBIN_HAS_ARUCO

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/as_mat.hpp"

namespace tribin::calibration_detail {
namespace {

constexpr std::pair<const char*, int> kDictionaries[] = {
    {"4X4_50", cv::aruco::DICT_4X4_50},
    {"4X4_100", cv::aruco::DICT_4X4_100},
    {"4X4_250", cv::aruco::DICT_4X4_250},
    {"4X4_1000", cv::aruco::DICT_4X4_1000},
    {"5X5_50", cv::aruco::DICT_5X5_50},
    {"5X5_100", cv::aruco::DICT_5X5_100},
    {"5X5_250", cv::aruco::DICT_5X5_250},
    {"5X5_1000", cv::aruco::DICT_5X5_1000},
    {"6X6_50", cv::aruco::DICT_6X6_50},
    {"6X6_100", cv::aruco::DICT_6X6_100},
    {"6X6_250", cv::aruco::DICT_6X6_250},
    {"6X6_1000", cv::aruco::DICT_6X6_1000},
    {"7X7_50", cv::aruco::DICT_7X7_50},
    {"7X7_100", cv::aruco::DICT_7X7_100},
    {"7X7_250", cv::aruco::DICT_7X7_250},
    {"7X7_1000", cv::aruco::DICT_7X7_1000},
    {"ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
};

cv::Ptr<cv::aruco::Dictionary> dictionary_of(const std::string& name) {
  std::string all;
  for (const auto& [known, number] : kDictionaries) {
    if (name == known) return cv::aruco::getPredefinedDictionary(number);
    all += (all.empty() ? "" : ", ") + std::string(known);
  }
  throw Error(ErrorCode::bad_option, "board: dictionary: saw " + name + ", wanted one of " + all);
}

using Quad = std::vector<cv::Point2f>;

/// Marker id of the light squares, row by row. \param first_dark  whether the upper left square is dark.
std::map<int, std::pair<int, int>> layout(const Board& board, bool first_dark) {
  std::map<int, std::pair<int, int>> out;
  for (int r = 0; r < board.rows; ++r)
    for (int c = 0; c < board.columns; ++c)
      if (((c + r) % 2 == 0) != first_dark) out.emplace(static_cast<int>(out.size()), std::pair{c, r});
  return out;
}

/// The marker's corners on the board [mm], as detectMarkers orders them; origin at the first inner corner.
Quad marker_on_board(const Board& board, int c, int r) {
  const double gap = 0.5 * (board.pitch_mm - board.marker_mm);
  const auto at = [&](int right, int down) {
    return cv::Point2f(static_cast<float>((c - 1) * board.pitch_mm + gap + right * board.marker_mm),
                       static_cast<float>((r - 1) * board.pitch_mm + gap + down * board.marker_mm));
  };
  return {at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
}

/// The markers that lie where a layout has them: by a homography that most agree on.
std::map<std::pair<int, int>, Quad> placed(const Board& board, bool first_dark, const std::vector<int>& ids,
                                           const std::vector<Quad>& quads) {
  const auto squares = layout(board, first_dark);
  Quad from, to;
  std::vector<std::pair<int, int>> square;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto found = squares.find(ids[i]);
    if (found == squares.end()) continue;
    const Quad corners = marker_on_board(board, found->second.first, found->second.second);
    from.insert(from.end(), corners.begin(), corners.end());
    to.insert(to.end(), quads[i].begin(), quads[i].end());
    square.push_back(found->second);
  }
  std::map<std::pair<int, int>, Quad> out;
  if (square.size() < 2) return out;
  // A tenth of a marker is room for the lens, and less than a wrong square makes.
  const double limit = 0.1 * cv::norm(to[1] - to[0]) + 1;
  std::vector<uchar> inlier;
  if (cv::findHomography(from, to, inlier, cv::RANSAC, limit).empty()) return out;
  for (std::size_t i = 0; i < square.size(); ++i)
    if (inlier[4 * i] && inlier[4 * i + 1] && inlier[4 * i + 2] && inlier[4 * i + 3])
      out[square[i]] =
          Quad(to.begin() + static_cast<std::ptrdiff_t>(4 * i), to.begin() + static_cast<std::ptrdiff_t>(4 * i + 4));
  return out;
}

}  // namespace

std::optional<BoardSighting> find_charuco(const Image<std::uint8_t>& picture, const Board& board) {
  const auto dictionary = dictionary_of(board.dictionary);
  if (dictionary->bytesList.rows < board.columns * board.rows / 2)
    throw Error(ErrorCode::bad_option,
                "board: dictionary: saw " + board.dictionary + " with " + std::to_string(dictionary->bytesList.rows) +
                    " markers, wanted " + std::to_string(board.columns * board.rows / 2) + " for a " + describe(board));
  std::vector<Quad> quads;
  std::vector<int> ids;
  cv::aruco::detectMarkers(as_mat(picture), dictionary, quads, ids);
  auto markers = placed(board, true, ids, quads);
  if (board.rows % 2 == 0)
    if (auto other = placed(board, false, ids, quads); other.size() > markers.size()) markers = std::move(other);
  BoardSighting out;
  Quad rough;
  double window = 1e9;
  for (int r = 0; r + 1 < board.rows; ++r)
    for (int c = 0; c + 1 < board.columns; ++c) {
      // The two light squares at this corner lie on one of its diagonals.
      Quad from, to;
      for (const auto& [dc, dr] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}})
        if (const auto found = markers.find({c + dc, r + dr}); found != markers.end()) {
          const Quad corners = marker_on_board(board, c + dc, r + dr);
          from.insert(from.end(), corners.begin(), corners.end());
          to.insert(to.end(), found->second.begin(), found->second.end());
        }
      if (from.size() < 8) continue;
      const cv::Mat h = cv::findHomography(from, to);
      if (h.empty()) continue;
      Quad at;
      cv::perspectiveTransform(Quad{{static_cast<float>(c * board.pitch_mm), static_cast<float>(r * board.pitch_mm)}},
                               at, h);
      out.point.push_back(r * (board.columns - 1) + c);
      rough.push_back(at[0]);
      // The window ends before the markers' own corners.
      for (std::size_t q = 0; q < to.size(); ++q)
        window = std::min(window, 0.7 * std::max(std::abs(to[q].x - at[0].x), std::abs(to[q].y - at[0].y)));
    }
  if (out.point.size() < 6) return std::nullopt;
  const int half = std::clamp(static_cast<int>(window), 2, 15);
  Quad fine = rough;
  cv::cornerSubPix(as_mat(picture), fine, {half, half}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::MAX_ITER, 50, 0.001});
  BoardSighting kept;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    if (cv::norm(fine[i] - rough[i]) > half) continue;  // ran away to another edge
    kept.point.push_back(out.point[i]);
    kept.pixel.push_back(vec(fine[i]));
  }
  if (kept.point.size() < 6) return std::nullopt;
  return kept;
}

}  // namespace tribin::calibration_detail

#else

namespace tribin::calibration_detail {

std::optional<BoardSighting> find_charuco(const Image<std::uint8_t>&, const Board&) {
  throw Error(ErrorCode::bad_option, "ChArUco boards want OpenCV's module aruco: install libopencv-contrib-dev");
}

}  // namespace tribin::calibration_detail

#endif
