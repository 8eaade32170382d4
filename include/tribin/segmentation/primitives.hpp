#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tribin/core/geometry.hpp"
#include "tribin/surfel/surfels.hpp"

namespace tribin {

/// A torus is what fillets, bends of pipes and rings are: found and labelled, but no pose rests on it.
enum class PrimitiveType : std::uint8_t { plane, cylinder, cone, sphere, torus };
const char* name_of(PrimitiveType type);

/// A circle fitted to a piece of boundary.
struct BoundaryCircle {
  Vec3 center = Vec3::Zero();  ///< mm
  double radius_mm = 0;
  double rms_mm = 0;  ///< of the boundary points about the circle
  double arc = 0;     ///< [rad] covered by points
};

/// A closed boundary of a plane's support: the outer rim or a hole.
struct BoundaryLoop {
  bool inner = false;
  std::vector<Vec3f> points;             ///< mm, sub-pixel places on the depth edge, in order
  std::optional<BoundaryCircle> circle;  ///< where a circle explains it
};

/// One surface primitive. The covariance's parameters are (tilt about u, tilt about v [rad], shift along u, shift along
/// v, radius [mm], half angle [rad]) with u, v of orthonormal_basis(axis); a plane has (tilt, tilt, offset along the
/// axis in place 2); a sphere has its centre in places 0-2 and its radius in 4; a torus has its minor radius in place 5
/// and its shift along the axis nowhere. Unused rows are 0.
struct Primitive {
  int id = 0;  ///< from 1, the place in Primitives
  PrimitiveType type = PrimitiveType::plane;
  Vec3 axis = Vec3::UnitZ();     ///< unit. Plane: normal towards the camera / outward. Cylinder: z >= 0. Cone: from the
                                 ///< apex into the cone
  Vec3 point = Vec3::Zero();     ///< mm. Plane: centre of the support. Cylinder: on the axis at mid-height. Cone: apex.
                                 ///< Sphere, torus: centre
  double offset_mm = 0;          ///< plane: dot(axis, x) = offset
  double radius_mm = 0;          ///< cylinder, sphere; torus: of the circle that the tube runs along
  double minor_radius_mm = 0;    ///< torus: of the tube
  double half_angle = 0;         ///< cone [rad]
  double extent_min = 0;         ///< cylinder, cone: first place of the support along the axis, from `point` [mm]
  double extent_max = 0;         ///< last place
  double arc = 0;                ///< [rad] visible arc about the axis
  bool concave = false;          ///< seen from inside: a hole, a bore, a dish
  bool fillet = false;           ///< cylinder, torus: goes over into its neighbours without an edge on both sides
  bool radius_from_cad = false;  ///< the radius was held at a nominal value (short arcs)
  double area_mm2 = 0;
  double rms_mm = 0;  ///< of the raw points (CAD: vertices) about the surface
  int points = 0;     ///< raw points in the support
  Matrix6 covariance = Matrix6::Zero();
  std::vector<std::uint32_t> surfels;
  std::vector<BoundaryLoop> loops;  ///< plane only
  int peak = -1;                    ///< index into HoughSpaces::peaks
  std::string name;                 ///< the CAD's name, if it gives one

  double height_mm() const { return extent_max - extent_min; }
};

/// A maximum in IJK space (plane: direction) or in parameter space (axis, d).
struct HoughPeak {
  bool parameter_space = false;
  Vec3 direction = Vec3::UnitZ();
  double d = 0;
  double votes = 0;
};

/// The accumulators, kept for people to look at. Bins are those of golden_spiral().
struct HoughSpaces {
  std::vector<float> ijk_all;     ///< 4096 bins of the half sphere: area of all surfels
  std::vector<float> ijk_flat;    ///< of the flat ones
  std::vector<float> ijk_curved;  ///< of the ruled ones
  std::vector<float> parameter;   ///< 2048 bins of axes: votes at d = 0
  std::vector<HoughPeak> peaks;
};

struct Primitives {
  std::vector<Primitive> items;
  std::vector<std::int32_t> label_of_surfel;  ///< primitive id, 0 = none
  HoughSpaces spaces;
};

struct SegmentationOptions {
  std::vector<double> radii_mm;  ///< radii to expect (from the CAD); empty = free radii only
  double min_area_mm2 = 0;       ///< smallest support; 0 = 30 cells' worth
  bool boundaries = true;        ///< scan: trace the rims and holes of planes
};

/// Finds planes, cylinders, cones, spheres and tori by going back and forth between IJK space, parameter space and 3-D
/// space until nothing explainable is left. \source Barajas et al., section III-B; the votes, tests and fits are ours
/// (docs/segmentation.md).
Primitives segment(const Surfels& surfels, const SegmentationOptions& options = {});

/// Primitive id of each pixel (0 = none): the surfels' labels carried to the pixels within 3 local sigma.
Image<std::uint16_t> label_pixels(const Primitives& primitives, const Surfels& surfels);

/// Primitive id of each loose point in the input's order (0 = none).
std::vector<std::uint16_t> label_points(const Primitives& primitives, const Surfels& surfels);

/// Bin centres on the half sphere z >= 0 by the golden-section spiral.
std::vector<Vec3f> golden_spiral(int bins);

}  // namespace tribin
