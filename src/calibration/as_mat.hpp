#pragma once

#include <opencv2/core.hpp>

#include "tribin/core/geometry.hpp"
#include "tribin/core/image.hpp"

namespace tribin::calibration_detail {

/// OpenCV's view of a picture; the picture must outlive it and is not written through it.
inline cv::Mat as_mat(const Image<std::uint8_t>& picture) {
  return {picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.data.data())};
}

inline Vec2 vec(const cv::Point2f& p) { return {p.x, p.y}; }

}  // namespace tribin::calibration_detail
