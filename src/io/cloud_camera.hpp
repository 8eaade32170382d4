#pragma once

#include <optional>
#include <vector>

#include "tribin/core/camera.hpp"
#include "tribin/core/image.hpp"

namespace tribin::io {

/// How well a pinhole at the origin explains an organized cloud: x/z = (u - cx) / fx, y/z = (v - cy) / fy.
struct CameraFit {
  PinholeCamera camera;     ///< fx or fy is negative where the grid runs against the axis
  double rms_px = 1e9;      ///< of both axes together
  bool transposed = false;  ///< x/z runs with v rather than u
};

/// Least squares over all points with z > 0; others are left out. fx = 0 where they do not span the grid.
/// \cost 1280 x 1024: about 3 ms.
CameraFit fit_pinhole(const Image<Vec3f>& points);

/// The rays of a lens: x/z and y/z as polynomials of the fifth degree in (u, v), by least squares.
struct LensFit {
  Image<Vec3f> rays;    ///< z = 1, of all pixels; those with a point have the point's own ray
  double rms_px = 1e9;  ///< of the polynomial, with the given focal lengths
};
LensFit fit_lens(const Image<Vec3f>& points, const PinholeCamera& pinhole);

/// Where the camera of an organized cloud stands in any frame, from pixels and points alone (direct linear transform).
/// \return camera_from_file; nothing where the points do not tell it (all in a plane) or no camera sees them so.
/// \source Hartley & Zisserman, Multiple View Geometry, 2nd ed., sections 7.1 and 6.2.4.
std::optional<Pose> locate_camera(const Image<Vec3f>& points);

}  // namespace tribin::io
