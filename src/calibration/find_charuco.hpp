#pragma once

#include <optional>

#include "tribin/capture/board.hpp"
#include "tribin/core/image.hpp"

namespace tribin::calibration_detail {

/// The corners of a ChArUco board beside which both markers are seen; none where there are fewer than 6 such corners.
/// Boards with an even number of rows exist in two layouts (OpenCV up to 4.6 and after): both are tried.
std::optional<BoardSighting> find_charuco(const Image<std::uint8_t>& picture, const Board& board);

}  // namespace tribin::calibration_detail
