#pragma once

#include "tribin/capture/board.hpp"
#include "tribin/capture/decode.hpp"

namespace tribin {

/// Where a projector would see the points of a board: the projector pixel that lights each of them.
/// \param seen     the board in the camera's picture.
/// \param decoded  the camera's frames of the board where it stood then; needs columns and rows.
/// \return the points about which enough was decoded, on all sides. \throws Error bad_input, without columns and rows.
/// \source Moreno and Taubin 2012: about each point a homography from camera to projector pixels, by the decoded pixels
///         of the squares around it, weighed by their modulation.
BoardSighting projector_points(const BoardSighting& seen, const Decoded& decoded);

}  // namespace tribin
