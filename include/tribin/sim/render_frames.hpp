#pragma once

#include <cstdint>
#include <vector>

#include "tribin/capture/decode.hpp"
#include "tribin/capture/rig.hpp"
#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// What the projector shows, and what else of light there is. Camera, projector and surfaces are those of the fast
/// mode.
struct RenderOptions {
  std::vector<Pattern> patterns;  ///< as make_patterns draws them; their finest period is the sensor's
  int projector_width = 1920;     ///< [px]
  int projector_height = 1200;    ///< [px]
  double ambient = 8;             ///< light that is always there, on a surface of albedo 0.5 [grey levels]
  double defocus_px = 0.7;        ///< sd of the projector's blur [projector px], >= 0
  double gamma = 1;               ///< light = level^gamma; 1 = the projector's curve is corrected, in (0, 4]
  int bounce_rays = 0;            ///< rays of one diffuse bounce a pixel, 0 = none; 256 leave 0.5 grey levels of grain
};

/// What the camera takes of each pattern: 8 bit, with image noise of the sensor's sd and correlation. Light of a pixel:
/// the projector's on its surface (diffuse and lobe, with shadow), what it mirrors once (mirror_share), one bounce from
/// other surfaces, ambient light; on depth edges the mean of five rays. The sensor's facing_modulation is that of its
/// finest fringes after the projector's blur. Its systematic, lost_share, min_modulation and max_incidence are not
/// used: they are calibration, mishap and the decoder's matter. \throws Error out_of_range, naming the setting.
FrameStack render_frames(const std::vector<Body>& bodies, const StructuredLight& sensor, const RenderOptions& options,
                         std::uint64_t seed);

/// The rig that takes them, exactly calibrated: camera in the rig's origin, projector beside it, its optical centre
/// moved so that the camera's axis at the reference distance falls on the middle of the projector's picture.
Rig rig_of(const StructuredLight& sensor, const RenderOptions& options);

}  // namespace tribin::sim
