#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tribin/core/camera.hpp"
#include "tribin/core/image.hpp"

namespace tribin {

/// How far depths are off. "sigma correlated over c px" is white noise filtered by a Gaussian kernel of sd c px and
/// scaled to sd sigma.
struct NoiseProfile {
  double sigma_mm = 0;         ///< sd of z at the scan's median depth; 0 = unknown, estimated from the scan
  double correlation_px = -1;  ///< c above, in [0, 5]; < 0 = unknown, estimated from the scan
  double scale_error = 0;      ///< sd of the relative scale error, common to the whole scan (systematic)
  double offset_mm = 0;        ///< sd of a common depth offset (systematic)
  double shape_error = 0;      ///< rms of a relative depth error that changes smoothly over the image (systematic)
};

/// Why a pixel has no measurement: values of Scan::invalid_reason. Decoders and simulators share them.
enum class Invalid : std::uint8_t {
  measured = 0,
  nothing_there,       ///< no surface on the ray (known to simulators only)
  shadow,              ///< out of the projector's sight (known to simulators only; a decoder finds it dark)
  dark,                ///< too little fringe modulation to tell it from image noise
  grazing,             ///< a surface seen or lit too flat
  saturated,           ///< too few pattern images below the camera's full scale
  lost,                ///< for no reason that is modelled
  uncertain_bit,       ///< a code bit lies within the image noise of its threshold
  order_inconsistent,  ///< code and phase, or the phases of several periods, contradict each other
  unmatched,           ///< the other camera does not see this place, or sees it twice
  out_of_view          ///< no source pixel: outside of the raw image, or beyond what the rig can measure
};
inline constexpr int kInvalidReasons = 11;
/// The enumerator's own name.
std::string_view name_of(Invalid reason);

/// When and from where a scan was taken: what a camera on a robot's flange needs. Times are milliseconds since 1970,
/// UTC.
struct Taken {
  std::optional<std::int64_t> time_ms;         ///< when the first picture of the scan was begun
  std::optional<Pose> base_from_flange;        ///< of the flange that holds the camera
  std::optional<std::int64_t> flange_time_ms;  ///< when the robot told that pose

  bool known() const { return time_ms || base_from_flange; }
};

/// An organized depth scan: z along the optical axis of an ideal pinhole. x and y are never stored.
struct Scan {
  Image<float> z_mm;  ///< H x W, NaN = no measurement
  PinholeCamera camera;
  NoiseProfile noise;
  Image<std::uint8_t> modulation;      ///< H x W grey levels of fringe modulation; empty if not known
  Image<std::uint8_t> invalid_reason;  ///< H x W of Invalid; empty if not known
  Image<Vec3f> rays;                   ///< only where the grid is no pinhole: ray with z = 1 of each pixel; else empty
  Pose input_from_camera = Pose::Identity();  ///< the file's own frame; results are given in it
  Taken taken;
  std::string source;  ///< file name, for messages
  std::vector<std::string> warnings;

  int width() const { return z_mm.width; }
  int height() const { return z_mm.height; }
  Vec3 point(int u, int v) const {
    const double z = z_mm(u, v);
    return rays.empty() ? camera.point(u, v, z) : Vec3(rays(u, v).cast<double>() * z);
  }
};

/// Number of pixels with a measurement.
std::size_t valid_count(const Scan& scan);

/// Loose points, without a grid.
struct PointSet {
  std::vector<Vec3f> points;      ///< mm, in the file's frame; no NaN
  std::optional<Vec3> viewpoint;  ///< where the camera stood; none = normals stay unsigned
  Taken taken;
  std::string source;
  std::vector<std::string> warnings;
};

}  // namespace tribin
