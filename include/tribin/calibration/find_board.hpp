#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "tribin/capture/board.hpp"
#include "tribin/core/image.hpp"

/// Boards in pictures, by OpenCV: a library of its own, tribin::calibration.
namespace tribin {

/// Reads a grey picture of any format that OpenCV knows (PNG, JPEG, BMP, TIFF, ..), colours turned to grey. 16 bit are
/// scaled to 8 by the brightest pixels, for cameras fill 10, 12 or all of them. Never turned by what EXIF says: the
/// sensor's own rows count. \throws Error bad_input for what cannot be read as a picture.
Image<std::uint8_t> read_picture(const std::filesystem::path& path);
/// The scaling alone.
Image<std::uint8_t> to_8_bit(const Image<std::uint16_t>& picture);

/// The board's points in a picture, to a part of a pixel. Chessboards and circles are found whole or not at all;
/// ChArUco corners where both of the markers beside them are seen. Chessboards are numbered from a corner behind which
/// a dark square lies, where that tells corners apart (look_alike_turns).
/// \return none where there is no such board. \throws Error bad_option for a dictionary that is not known, or ChArUco
/// where OpenCV's contributed modules are not built in.
/// \source chessboard: Duda and Frese 2018 (findChessboardCornersSB); circles: findCirclesGrid, each centre by the grey
///         levels' centroid; ChArUco: detectMarkers, corners from the markers' homography, then cornerSubPix.
std::optional<BoardSighting> find_board(const Image<std::uint8_t>& picture, const Board& board);

/// Inner corners of a chessboard of any size (3 x 3 at least), the larger number first: says what a picture shows where
/// the wanted board was not found.
std::optional<std::pair<int, int>> chessboard_size(const Image<std::uint8_t>& picture);

}  // namespace tribin
