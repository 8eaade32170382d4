#include "tribin/capture/board.hpp"

#include "tribin/core/error.hpp"

namespace tribin {
namespace {

/// Points in a row and rows of points.
std::pair<int, int> grid_of(const Board& board) {
  const int less = board.kind == BoardKind::charuco ? 1 : 0;
  return {board.columns - less, board.rows - less};
}

}  // namespace

void validate(const Board& board) {
  const auto bad = [](const std::string& what, const std::string& seen, const std::string& wanted) {
    throw Error(ErrorCode::bad_option, "board: " + what + ": saw " + seen + ", wanted " + wanted);
  };
  const int least = board.kind == BoardKind::charuco ? 3 : 2;
  for (const auto& [name, count] : {std::pair{"columns", board.columns}, {"rows", board.rows}})
    if (count < least || count > 100) bad(name, std::to_string(count), std::to_string(least) + "..100");
  if (board.columns * board.rows < 6) bad("size", describe(board), "6 points or more");
  if (!(board.pitch_mm > 0 && board.pitch_mm < 1e4))
    bad("pitch", std::to_string(board.pitch_mm) + " mm", "a length > 0");
  if (board.kind == BoardKind::charuco && !(board.marker_mm > 0 && board.marker_mm < board.pitch_mm))
    bad("marker", std::to_string(board.marker_mm) + " mm", "a length > 0 below that of a square");
}

std::vector<Vec3> board_points(const Board& board) {
  const auto [columns, rows] = grid_of(board);
  std::vector<Vec3> out;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      if (board.kind == BoardKind::asymmetric_circles)
        out.push_back(Vec3(c + 0.5 * (r % 2), 0.5 * r, 0) * board.pitch_mm);
      else
        out.push_back(Vec3(c, r, 0) * board.pitch_mm);
    }
  return out;
}

std::string describe(const Board& board) {
  const std::string size = std::to_string(board.columns) + " x " + std::to_string(board.rows);
  switch (board.kind) {
    case BoardKind::chessboard:
      return "chessboard of " + size + " inner corners";
    case BoardKind::circles:
      return "grid of " + size + " circles";
    case BoardKind::asymmetric_circles:
      return "asymmetric grid of " + size + " circles";
    case BoardKind::charuco:
      return "ChArUco board of " + size + " squares (" + board.dictionary + ")";
  }
  return size;
}

std::vector<int> look_alike_turns(const Board& board) {
  const bool square = board.columns == board.rows;
  switch (board.kind) {
    case BoardKind::charuco:
      return {0};
    case BoardKind::circles:
      return square ? std::vector<int>{0, 1, 2, 3} : std::vector<int>{0, 2};
    // A half turn takes the first row to the last one: of the same kind where their number is odd.
    case BoardKind::asymmetric_circles:
      return board.rows % 2 == 1 ? std::vector<int>{0} : std::vector<int>{0, 2};
    case BoardKind::chessboard:
      break;
  }
  // The colour of the square behind the first corner tells a half turn where columns + rows is odd, and a quarter turn
  // where columns is odd.
  if ((board.columns + board.rows) % 2 == 1) return {0};
  if (!square) return {0, 2};
  return board.columns % 2 == 1 ? std::vector<int>{0, 2} : std::vector<int>{0, 1, 2, 3};
}

int turned_point(const Board& board, int point, int quarter_turns) {
  const auto [columns, rows] = grid_of(board);
  TRIBIN_ASSERT(quarter_turns % 2 == 0 || columns == rows);
  const int turns = (quarter_turns % 4 + 4) % 4;
  int c = point % columns, r = point / columns;
  if (turns % 2 == 1) {
    const int old = c;
    c = columns - 1 - r, r = old;
  }
  if (turns >= 2) c = columns - 1 - c, r = rows - 1 - r;
  return r * columns + c;
}

}  // namespace tribin
