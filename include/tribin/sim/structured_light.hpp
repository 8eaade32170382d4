#pragma once

#include <cstdint>
#include <vector>

#include "tribin/cad/mesh.hpp"
#include "tribin/core/camera.hpp"
#include "tribin/core/geometry.hpp"
#include "tribin/core/image.hpp"
#include "tribin/scan/scan.hpp"

namespace tribin::sim {

/// A camera and a fringe projector beside it, parallel, `baseline_mm` apart along the camera's +x.
struct StructuredLight {
  PinholeCamera camera{1280, 1024, 1800, 1800, 639.5, 511.5};
  double baseline_mm = 180;
  double projector_focal_px = 1500;
  double fringe_period_px = 16;         ///< in projector pixels
  int steps = 4;                        ///< of the phase shift, >= 3
  double image_noise = 1.5;             ///< sd of a grey level
  double noise_correlation_px = 0.5;    ///< sd of the Gaussian that correlates the noise [px], in [0, 5]
  double facing_modulation = 70;        ///< grey levels for a facing surface of albedo 0.5 at reference_mm
  double reference_mm = 800;            ///< distance at which the projector's light is set
  double min_modulation = 0;            ///< below it a pixel is not measured; 0 = as the decoder has it: 5 sd of the
                                        ///< modulation that image noise alone makes
  double max_incidence = 75 * kDegree;  ///< to camera or projector; beyond it a pixel is not measured
  double highlight = 0.5;               ///< 0 none .. 1: strength of mirror highlights, which saturate
  double mirror_share = 0;              ///< share of the light that shiny bodies throw on as clean mirrors, once
  double systematic = 0.0002;           ///< largest relative depth error, quadratic over the image
  double scale = 1;                     ///< of all depths: 1 + an error that the whole image has in common
  double noise_mm = 0;                  ///< > 0: sd of z on a facing surface of albedo 0.5 at reference_mm, in place of
                                        ///< the one that image_noise gives
  double lost_share = 0;                ///< share of the pixels that are lost for no reason that is modelled, in blots
  bool mixed_pixels = true;             ///< pixels on depth edges mix the fringes of both surfaces
};

/// A rigid body in view.
struct Body {
  const Mesh* mesh = nullptr;
  Pose camera_from_body = Pose::Identity();
  double albedo = 0.5;
  double shine = 1;     ///< 0 matt .. 1 machined metal: scales StructuredLight::highlight
  bool counted = true;  ///< false: scenery, whose whole silhouette nobody asks for: BodyTruth::pixels_all stays 0
};

/// What the camera sees of one body. Counts as in BOP.
struct BodyTruth {
  Pose camera_from_body = Pose::Identity();
  int pixels_all = 0;                     ///< of its silhouette, were it alone
  int pixels_visible = 0;                 ///< whose centre ray meets it first
  int pixels_measured = 0;                ///< of these, with a measurement
  int box_all[4] = {-1, -1, -1, -1};      ///< x, y, width, height of the silhouette [px]
  int box_visible[4] = {-1, -1, -1, -1};  ///< of the visible pixels
  double visible_fraction() const { return pixels_all > 0 ? static_cast<double>(pixels_visible) / pixels_all : 0; }
};

/// A simulated scan with everything that is true about it. All images have the camera's size.
struct SimulatedScan {
  Scan scan;                 ///< what a user would get; its noise is left unknown, as in most files
  Image<float> true_z;       ///< [mm], NaN where nothing is there
  Image<std::int16_t> body;  ///< index into the bodies, -1 where nothing is there
  Image<std::int32_t> face;  ///< CAD face id (or triangle index + 1 for meshes without faces), 0 = nothing
  Image<Vec3f> normal;       ///< unit, camera frame, towards the camera; zero where nothing is there
  Image<float> sigma_mm;     ///< sd of z that the noise law gives there, 0 where nothing is measured
  std::vector<BodyTruth> bodies;
};

/// Casts the scene, lights it, and measures it as a structured-light sensor does: projector shadow, noise that grows
/// with distance, incidence and darkness (correlated over the pixels), mixed pixels, drop-out by grazing and mirror
/// angles, fringes of other surfaces seen in shiny ones, a smooth systematic error. The same bytes for any number of
/// threads. \param bodies  in the camera frame; a table is a body too. \param seed    of noise and systematic error.
/// \throws Error  out_of_range, naming the setting, when the sensor makes no sense.
/// \source        noise law: sigma_z = z^2 / (B f_p) * period / (2 pi) * sqrt(2 / steps) * image_noise / modulation,
/// image
///                noise with the rounding to 8 bit, sd 1 / sqrt(12), that is not correlated.
SimulatedScan simulate_scan(const std::vector<Body>& bodies, const StructuredLight& sensor, std::uint64_t seed);

}  // namespace tribin::sim
