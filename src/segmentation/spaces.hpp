#pragma once

#include <functional>
#include <optional>

#include "segmentation/direction_bins.hpp"
#include "segmentation/region.hpp"

namespace tribin::segmentation_detail {

/// What was found in one of the spaces, not yet a Primitive.
struct FoundSurface {
  Fit fit;
  Indices support;
  bool radius_from_cad = false;
  double arc = 0;
  int peak = -1;
};

/// Limits that all spaces share, derived once from the options and the surfels.
struct Limits {
  std::vector<double> radii_mm;
  double min_area_mm2 = 0;
  std::size_t min_surfels = 0;
  double max_radius_mm = 0;  ///< free radii beyond this are not told from planes
};

/// Who votes in IJK space. `undecided` surfels could lie on a large cylinder; a plane of them must prove flat as a
/// whole.
enum class PlaneVoters { flat, flat_and_undecided };

/// IJK space: peaks of the surfels' normals; in 3-D space their components become planes. Marks what it takes.
void find_planes(Scene& scene, const Limits& limits, PlaneVoters voters, HoughSpaces& spaces,
                 std::vector<FoundSurface>& found);

/// Parameter space: peaks of rulings; in 3-D space centres and radii become cylinders, and cones where they taper.
void find_cylinders(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found);

/// What rulings do not explain: cones with wide angles and spheres, from components of curved surfels.
void find_cones_and_spheres(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found);

/// One component -> the cylinder (or cone) that explains most of it, if it passes all tests. \param axis near the
/// truth.
std::optional<FoundSurface> explain_round(Scene& scene, const Indices& component, const Vec3& axis,
                                          const Limits& limits);

/// Arc of the support about the surface's axis [rad]: the circle less its largest gap.
double arc_of(const Surfels& surfels, const Indices& support, const Surface& surface);

/// Takes the support: labels it with the number that `found` will have.
void take(Scene& scene, std::vector<FoundSurface>& found, FoundSurface&& next);

}  // namespace tribin::segmentation_detail
