#pragma once

#include "capture/ideal_view.hpp"

namespace tribin::capture_detail {

/// Where the second view sees the projector column of each pixel of the first, in the same row.
struct StereoMatch {
  Image<float> column;       ///< [px] in the second view; NaN = nowhere, or in two places
  Image<float> slope;        ///< projector columns per pixel there, > 0
  Image<float> noise_share;  ///< of the second view's variance of a column that the line through it leaves
};

StereoMatch match_columns(const ViewImage& first, const ViewImage& second);

}  // namespace tribin::capture_detail
