#pragma once

#include <optional>
#include <string>

#include "genicam/aravis.hpp"
#include "tribin/camera/coord3d.hpp"
#include "tribin/capture/decode.hpp"

// What lies in the buffers of a camera.
namespace tribin::genicam {

/// Appends a grey picture (Mono8, or Mono10, Mono12, Mono16 in 16 bit) to the stack.
/// \throws Error bad_input for other pixel formats, device for fewer bytes than the picture has.
void append_picture(const std::string& name, ArvBuffer* buffer, FrameStack& stack);

/// The points of a buffer, alone or one part of several, read by the camera's Scan3d features; chunks of the buffer
/// are believed before them. \throws Error bad_input where there are none in a format that is read.
Scan scan_of_buffer(const std::string& name, ArvCamera* camera, ArvBuffer* buffer);

}  // namespace tribin::genicam
