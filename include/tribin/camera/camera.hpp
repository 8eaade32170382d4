#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tribin/capture/decode.hpp"
#include "tribin/capture/rig.hpp"
#include "tribin/capture/triangulate.hpp"
#include "tribin/scan/scan.hpp"

/// Cameras of all kinds behind one interface: folders of recorded shots, the simulated camera (tribin::sim), GenICam
/// devices (tribin::genicam). docs/camera.md.
namespace tribin {

/// What a camera gives of one scene.
struct Shot {
  /// The frames of a pattern set, one stack for each camera of the rig; or a scan that the camera measured itself.
  std::variant<std::vector<FrameStack>, Scan> content;
  std::optional<Rig> rig;  ///< frames of cameras that know their own
  Taken taken;
  std::vector<std::string> warnings;  ///< as "2 incomplete frames, the burst was taken again"
};

class Camera {
 public:
  virtual ~Camera() = default;
  /// For messages: "genicam:Basler-23517".
  virtual std::string name() const = 0;
  /// Takes the next scene, and waits until it is whole. \throws Error device (no answer, lost, frames that stay
  /// incomplete), too_little_data (a recording is at its end).
  virtual Shot grab() = 0;
};

/// A scan with all that it was made of. Of cameras that measure themselves there is the scan alone.
struct ShotScan {
  Triangulated result;
  std::vector<Decoded> decoded;  ///< of each rig camera
};

/// Decodes and triangulates a shot; hands on a scan as it is. The scan gets the shot's time and place.
/// \param rig  of frames, before the shot's own; one of the two is needed. \throws Error bad_option where it is
/// missing, bad_input where it has other cameras than
///             the frames, too_little_data where no pixel is measured.
ShotScan scan_of(Shot shot, const std::optional<Rig>& rig, const DecodeOptions& options = {});

/// The clock: milliseconds since 1970, UTC.
std::int64_t now_ms();

}  // namespace tribin
