#pragma once

#include <utility>

#include "tribin/capture/decode.hpp"
#include "tribin/capture/rig.hpp"

namespace tribin::capture_detail {

/// A pinhole without distortion at a camera's place, turned against it.
struct IdealView {
  PinholeCamera pinhole;
  Matrix3 camera_from_view = Matrix3::Identity();
};

/// The camera without its distortion.
IdealView undistorted_view(const RigCamera& camera);

/// Two views whose rows are epipolar lines: the second stands on the x axis of the first, both have one focal length
/// and cy; each keeps its image in the middle. \throws Error bad_input where the cameras stand rather above than beside
/// each other. \source Bouguet's method, as OpenCV's stereoRectify has it.
std::pair<IdealView, IdealView> rectified_views(const RigCamera& first, const RigCamera& second);

/// What a view sees of a decoded image.
struct ViewImage {
  Image<float> column, row;  ///< NaN = none; row may be empty
  Image<float> brightness;   ///< [grey levels]
  Image<std::uint8_t> modulation, invalid_reason;
  float step = 0;          ///< median change of the column from pixel to pixel
  double noise_share = 1;  ///< of the columns' variance that the interpolation leaves
};

/// Resamples columns, rows and pictures by bilinear interpolation of the four pixels about each ray; one of the four
/// may be missing (then the other three span the plane). None over a jump of the column: nothing is made up on edges.
ViewImage resample(const Decoded& decoded, const RigCamera& camera, const IdealView& view);

/// Throws bad_input where the decoded image has another size than the rig's camera; takes the frames' size where the
/// rig names none.
RigCamera with_size_of(const Decoded& decoded, RigCamera camera, const std::string& source);

}  // namespace tribin::capture_detail
