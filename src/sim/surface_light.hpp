#pragma once

#include <vector>

#include "sim/ray_scene.hpp"
#include "tribin/sim/structured_light.hpp"

namespace tribin::sim {

/// What a point throws back of the projector's light, to who looks at it.
struct SurfaceLight {
  bool lit = false;    ///< the projector sees the point, from the side that is looked at
  double diffuse = 0;  ///< fringe modulation by diffuse reflection [grey levels]
  double lobe = 0;     ///< strength of the mirror highlight; 0.45 fills the camera's range
  double cos_light = 0, cos_eye = 0;
};

/// Grey levels of modulation that a lobe of 1 adds: a lobe of 0.45 adds 1.5 times the diffuse light of a facing
/// surface, which with that light fills a camera of 8 bit.
inline double lobe_modulation(const StructuredLight& s) { return s.facing_modulation * 1.5 / 0.45; }

/// \param normal  unit, towards who looks. \param eye  unit, from the point to who looks.
/// \source        diffuse: Lambert, falling with the square of the distance from the projector; lobe: Blinn's half
/// vector
///                with exponent 200 (machined metal: half width 6 deg).
SurfaceLight light_at(const RayScene& scene, const StructuredLight& s, const Vec3& point, const Vec3& normal,
                      const Vec3& eye, const Body& body);

/// Does the surface break between this pixel and a neighbour? \param limit  on the second difference of z [mm].
bool on_edge(const Image<std::int16_t>& body, const Image<float>& z, int u, int v, double limit);

/// sd of z for a facing surface of albedo 0.5 at the reference distance, by the noise law.
double facing_sigma(const StructuredLight& s);

/// Sub-samples of a pixel on an edge, beside its middle [px].
inline constexpr double kSubSamples[4][2] = {{-0.3, -0.3}, {0.3, -0.3}, {-0.3, 0.3}, {0.3, 0.3}};
/// A break is more than the noise shows: below it, mixing changes nothing that one could see [mm].
double edge_limit(const StructuredLight& s);

/// \throws Error out_of_range, naming the setting, when the sensor makes no sense.
void check_sensor(const StructuredLight& s);

}  // namespace tribin::sim
