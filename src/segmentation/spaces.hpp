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

inline constexpr double kRoundSlack = 4.0 * kDegree;  // the quadric's gradient on a tight radius, cubic terms
inline constexpr double kMaxRmsSigma = 3.5;           // rms of cell means in sigmas: right ones 1-1.5, compromises > 4

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

/// Parameter space: rulings vote for their axes, for people to look at. Does nothing the second time.
void fill_parameter_space(const Scene& scene, HoughSpaces& spaces);

/// Parameter space: peaks of rulings; in 3-D space centres and radii become cylinders, and cones where they taper.
void find_cylinders(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found);

/// Parameter space by great circles: the normals of a component of what is left vote for all axes across them. Finds
/// cylinders whose surfels bend too little, or are too few, for rulings of their own.
void find_by_great_circles(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found);

/// Joins pieces of one surface that something hides or interrupts, and strips that were taken for another one (of a
/// cone as a cylinder): parameters equal within their joint covariance (chi-square) or one piece on the other's
/// surface, a joint fit that explains both as well as two fits do, and, along the axis, nothing seen behind the surface
/// in the gap. Planes stay apart: each is a face.
void merge_pieces(Scene& scene, std::vector<FoundSurface>& found);

/// What rulings do not explain: cones with wide angles, spheres and tori, from components of curved surfels; the type
/// by the Bayesian information criterion.
void find_cones_and_spheres(Scene& scene, const Limits& limits, std::vector<FoundSurface>& found);

/// One component -> the cylinder (or cone) that explains most of it, if it passes all tests. \param axis near the
/// truth.
std::optional<FoundSurface> explain_round(Scene& scene, const Indices& component, const Vec3& axis,
                                          const Limits& limits);

/// The last fit of a surface of revolution: on the raw pixels of a scan, because the mean of a cell lies off a tight
/// radius, else on all surfels. The residuals of the cells stay what the tests judge.
void polish(const Scene& scene, FoundSurface& surface);

/// Whether a cone's fit proves that it is no cylinder: its half angle against its own sigma, and against what bends and
/// slow waves of a sensor feign.
bool tapers(const Fit& cone);

/// Arc of the support about the surface's axis [rad]: the circle less its largest gap.
double arc_of(const Surfels& surfels, const Indices& support, const Surface& surface);

/// Back and forth among the spaces on what is left, until a round explains nothing more.
void explain(Scene& scene, const Limits& limits, HoughSpaces& spaces, std::vector<FoundSurface>& found);

/// Takes the support: labels it with the number that `found` will have.
void take(Scene& scene, std::vector<FoundSurface>& found, FoundSurface&& next);

}  // namespace tribin::segmentation_detail
