#pragma once

#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"

/// Flat boards with points at known places, which calibration looks at.
namespace tribin {

enum class BoardKind {
  chessboard,          ///< columns x rows inner corners
  circles,             ///< columns x rows circles on a square grid
  asymmetric_circles,  ///< `rows` rows of `columns` circles, every second row moved by half a pitch
  charuco              ///< columns x rows squares with ArUco markers in the light ones: may be seen in part
};

struct Board {
  BoardKind kind = BoardKind::chessboard;
  int columns = 0;                    ///< as the kind says, 2..100
  int rows = 0;                       ///< as the kind says, 2..100
  double pitch_mm = 0;                ///< side of a square; distance of circles in a row
  double marker_mm = 0;               ///< charuco: side of a marker, < pitch_mm
  std::string dictionary = "4X4_50";  ///< charuco: OpenCV's name without DICT_
};

/// \throws Error bad_option, naming the first bad field.
void validate(const Board& board);

/// The board's points in its own frame [mm], z = 0, row by row; x along a row, y down the rows, seen from the front
/// with z away from the viewer. ChArUco: the inner corners.
std::vector<Vec3> board_points(const Board& board);

/// "chessboard of 7 x 6 inner corners"
std::string describe(const Board& board);

/// Quarter turns after which the board looks the same, 0 first: where there are more, its first point is a choice.
std::vector<int> look_alike_turns(const Board& board);
/// The number that point i has after so many quarter turns. Odd turns are for as many rows as columns only.
int turned_point(const Board& board, int point, int quarter_turns);

/// What one picture shows of a board.
struct BoardSighting {
  std::vector<int> point;   ///< rising numbers of board_points
  std::vector<Vec2> pixel;  ///< where they are; pixel centres at integers. Circles: the centroid of their picture
  std::vector<double> area_px = {};  ///< circles: how much of the picture each covers; empty = not known
};

}  // namespace tribin
