#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tribin/camera/camera.hpp"

/// GenICam cameras (GigE Vision, USB3 Vision) by Aravis. docs/camera.md tells how they and a projector go together.
namespace tribin::genicam {

/// What starts each picture.
enum class Trigger {
  free_run,        ///< the camera's own clock: for Coord3D cameras, which are given no patterns
  software,        ///< one software trigger a picture: the projector is stepped by the camera's exposure output
  software_burst,  ///< one software trigger a burst of all pictures, at the camera's frame rate
  hardware         ///< each pattern of the projector triggers one picture on `line`
};
/// "free_run", "software", "software_burst", "hardware". \throws Error bad_option for any other name.
Trigger trigger_of(const std::string& name);

struct GenicamOptions {
  std::string id;       ///< as Aravis lists it, or the camera's address; empty = the first that is found
  FrameStack sequence;  ///< patterns, camera name and projector size of the set, without images; no patterns: the
                        ///< camera measures itself and gives Coord3D
  Trigger trigger = Trigger::free_run;
  std::string line = "Line1";  ///< of a hardware trigger
  double exposure_ms = 0;      ///< of pictures whose pattern names none; 0 = as the camera is set
  int packet_size = 0;         ///< of GigE Vision [bytes], 0 = the largest that the network carries
  bool packet_socket = true;   ///< false: plain UDP sockets, for those without CAP_NET_RAW and for loopback
  double timeout_s = 2;        ///< for each picture, beyond its exposure
  int retries = 3;             ///< how often a burst with incomplete pictures is taken again
  Taken taken = {};            ///< of each shot: base_from_flange; its time is the clock's
};

/// \throws Error device (exit code 6), one sentence: no such camera, it is in use, a feature that it does not have;
///               and by `grab`: lost, no picture in time, pictures that stay incomplete; bad_input for a pixel format
///               that is not read.
std::unique_ptr<Camera> open_genicam_camera(const GenicamOptions& options);

}  // namespace tribin::genicam
