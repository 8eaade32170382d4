#pragma once

#include <span>

#include "tribin/capture/decode.hpp"
#include "tribin/capture/rig.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin {

/// How far apart along the other axis the two views of a point are: 0 for a calibration that fits.
struct EpipolarCheck {
  int places = 0;        ///< parts of the image that could be judged; 0 = nothing known
  double median_px = 0;  ///< second minus first camera (measured minus predicted projector row)
  double spread_px = 0;  ///< half of the distance between the quartiles of the places
};

/// Depth from decoded frames.
struct Triangulated {
  Scan scan;  ///< ideal pinhole: the first camera without its distortion; with two cameras rectified (turned so that
              ///< rows are epipolar lines). Noise from modulation and geometry, reason of each pixel.
  Pose rig_from_scan = Pose::Identity();  ///< the scan's camera frame in the rig
  Image<float> column;                    ///< projector column on the scan's grid
  EpipolarCheck epipolar;
};

/// One camera and the projector: each pixel's ray against the plane (bent by the projector's lens) of its column.
/// Measured rows, if there are any, check it: beyond 5 sd + 2 px a pixel is unmatched.
/// \param decoded  of rig.cameras[0]; needs columns.
/// \throws Error bad_input, where sizes differ or the rig has no projector.
Triangulated triangulate(const Rig& rig, const Decoded& decoded);

/// Two cameras: equal projector columns along epipolar lines, to a part of a pixel by a line through five pixels of the
/// second camera. The projector need not be calibrated; its focal length and place do not enter.
/// The check of epipolar lines uses measured rows, or else the picture itself.
/// \param decoded  of rig.cameras[0] and [1]; need columns.
/// \throws Error bad_input, where sizes differ, or the cameras stand one above the other.
Triangulated triangulate(const Rig& rig, const Decoded& first, const Decoded& second);

}  // namespace tribin
